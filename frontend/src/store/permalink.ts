/** The part of the view that a link carries, in the URL's fragment: it never reaches a server. */
import type { Camera } from '../geometry/coordinates';
import { DEFAULT_LAYERS, DEFAULT_VIEW, LAYERS, type Layer, type ViewState } from './view';

export type Linked = Pick<ViewState, 'sensor' | 'selected' | 'layers' | 'range' | 'camera'>;

/** The fragment, without "#"; what is as by default is left out. */
export function toFragment(view: Linked): string {
  const parts = new URLSearchParams();
  if (view.sensor !== DEFAULT_VIEW.sensor) parts.set('sensor', view.sensor);
  if (view.selected !== null) parts.set('tag', view.selected);
  if (view.camera) {
    const { x, y, span } = view.camera;
    parts.set('view', [x, y, span].map((metres) => metres.toFixed(2)).join(','));
  }
  if (view.range) parts.set('range', `${short(view.range.low)},${short(view.range.high)}`);
  if (!sameLayers(view.layers, DEFAULT_LAYERS)) {
    parts.set('layers', LAYERS.filter((layer) => view.layers.has(layer)).join(','));
  }
  return parts.toString().replaceAll('%2C', ',');
}

/** Reads a fragment; a part that makes no sense counts as left out. */
export function fromFragment(fragment: string): Linked {
  const parts = new URLSearchParams(fragment.replace(/^#/, ''));
  const range = numbers(parts.get('range'), 2);
  const layers = parts.get('layers');
  return {
    sensor: parts.get('sensor') || DEFAULT_VIEW.sensor,
    selected: parts.get('tag') || null,
    camera: cameraOf(numbers(parts.get('view'), 3)),
    range:
      range?.[0] !== undefined && range[1] !== undefined && range[0] < range[1]
        ? { low: range[0], high: range[1] }
        : null,
    layers: layers === null ? DEFAULT_LAYERS : new Set(layers.split(',').filter(isLayer)),
  };
}

function cameraOf(values: readonly number[] | null): Camera | null {
  const [x, y, span] = values ?? [];
  if (x === undefined || y === undefined || span === undefined || span <= 0) return null;
  return { x, y, span };
}

function numbers(text: string | null, count: number): readonly number[] | null {
  const values = (text ?? '').split(',').map((part) => (part.trim() === '' ? NaN : Number(part)));
  return values.length === count && values.every(Number.isFinite) ? values : null;
}

const short = (value: number): string => String(Number(value.toPrecision(6)));

const isLayer = (name: string): name is Layer => (LAYERS as readonly string[]).includes(name);

function sameLayers(a: ReadonlySet<Layer>, b: ReadonlySet<Layer>): boolean {
  return a.size === b.size && [...a].every((layer) => b.has(layer));
}
