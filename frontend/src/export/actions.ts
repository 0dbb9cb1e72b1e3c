/** Export actions, for buttons and the menu. */
import { epochOf, now as pageNow, timeZone } from '../clock';
import { differenceText, divergingColours, signedText } from '../domain/difference';
import { errorColours } from '../domain/field';
import { errorNumber, readingText, valueText, withUnit, written } from '../domain/format';
import { IDEAL_ALPHA, idealParts } from '../domain/ideal';
import { rgbText, sensorColour } from '../domain/ramp';
import { tableCsv } from '../domain/table';
import { shown } from '../domain/text';
import { dateText, rosText, secondsOf, type Span, spanOf } from '../domain/time';
import { contextOf, newCanvas } from '../draw/surface';
import { lengthText, scaleBar } from '../geometry/coordinates';
import { theMap } from '../map/commands';
import { toFragment } from '../store/address';
import { type AppState, store } from '../store/app';
import {
  selectCatalogue,
  selectColouring,
  selectColumns,
  selectHeat,
  selectRange,
  selectRows,
  selectSensor,
} from '../store/derived';
import { rosNow, selectHasOwnTime, selectOrigin, selectShown } from '../store/moment';
import { isChosen } from '../store/view';
import { LANGUAGE, S } from '../strings';
import { fileName, save, saveCsv } from './save';

/**
 * Saves the table as shown, filtered and sorted; ages are as of the state's time. If called before the
 * sensors' names and units are loaded, it waits for them.
 */
export function saveTable(): void {
  const isKnown = (): boolean => store.get().twin.sensors.state !== 'waiting';
  if (isKnown()) {
    writeTable();
    return;
  }
  const stop = store.subscribe(() => {
    if (!isKnown()) return;
    stop();
    writeTable();
  });
}

function writeTable(): void {
  const state = store.get();
  const { snapshot, moment } = selectShown(state);
  if (!snapshot) return;
  const text = tableCsv(
    selectRows(state),
    selectCatalogue(state),
    selectColumns(state),
    snapshot.takenAt,
  );
  saveCsv('tags', text, epochOf(snapshot.takenAt), moment);
}

/** Saves the map as shown, with a footer: title, time, colours and scale bar. */
export async function saveMap(): Promise<void> {
  const layers = [...document.querySelectorAll<HTMLCanvasElement>('canvas[data-layer]')];
  const [first] = layers;
  const state = store.get();
  const { snapshot, moment } = selectShown(state);
  if (!first || first.width === 0 || !snapshot) return;
  // Not from the layout: on a phone, the map has no size behind the table.
  const ratio = first.width / (parseFloat(first.style.width) || first.width);
  const style = getComputedStyle(document.documentElement);
  const canvas = newCanvas(first.width, first.height + FOOTER_PX * ratio);
  const context = contextOf(canvas);
  theMap.get()?.take(() => {
    for (const layer of layers) context.drawImage(layer, 0, 0);
  });

  const takenAt = epochOf(snapshot.takenAt);
  // A recording or simulation has its own time: use that, not when the data arrived.
  const then = moment ?? (selectHasOwnTime(state) ? secondsOf(snapshot.at) : null);
  const { difference } = selectHeat(state) ?? {};
  const time = difference
    ? S.differenceTimes(rosText(difference.at), rosText(difference.against))
    : then === null
      ? dateText(takenAt)
      : S.asOf(rosText(then));
  const origin = selectOrigin(state);
  const footer: Footer = {
    ...legendOf(state),
    scale: state.viewport.view.scale,
    time: origin === null ? time : `${S.origin[origin]}, ${time}`,
  };
  context.setTransform(ratio, 0, 0, ratio, 0, first.height);
  drawFooter(context, first.width / ratio, footer, {
    ink: style.getPropertyValue('--ink'),
    surface: style.getPropertyValue('--surface'),
  });

  const blob = await new Promise<Blob | null>((resolve) => {
    canvas.toBlob(resolve, 'image/png');
  });
  if (blob) save(blob, fileName('map', 'png', takenAt, moment));
}

/** What the map's colours show, as in the page's legend. */
function legendOf(state: AppState): Pick<Footer, 'title' | 'ends' | 'ramps'> {
  const sensor = selectSensor(state);
  const label = shown(sensor.label, 32);
  const heat = selectHeat(state);
  if (heat?.difference) {
    const { low, high } = heat.range;
    return {
      title: S.difference(label),
      ends: [signedText(sensor, low), differenceText(sensor, high)],
      ramps: [divergingColours()],
    };
  }
  if (heat?.isError) {
    const most = withUnit(sensor, errorNumber(sensor, heat.range.high));
    return {
      title: `${label}: ${S.heats.error}`,
      ends: ['±\u00a00', `±\u00a0${most}`],
      ramps: [errorColours()],
    };
  }
  if (selectColouring(state) === 'ideal') {
    const colours = Object.values(idealParts(IDEAL_ALPHA)).flat();
    return { title: S.legendAgainst(label), ends: [S.below, S.above], ramps: [colours] };
  }
  const range = selectRange(state);
  const colour = sensorColour(sensor);
  return {
    title: label,
    ends: range && [valueText(sensor, range.low), readingText(sensor, range.high)],
    // Pin colours above heat-map colours.
    ramps: [1, sensor.maxAlpha].map((most) => [rgbText(colour, 0), rgbText(colour, most)]),
  };
}

/** Height of the footer below a saved map. */
export const FOOTER_PX = 56;
const EDGE_PX = 14;
const GAP_PX = 8;
const RAMP_PX = { width: 90, height: 12 } as const;
const LONGEST_BAR_PX = 70;
const FONT = '13px "Inter Variable", system-ui, sans-serif';

export interface Footer {
  readonly title: string;
  readonly time: string;
  /** Values at the ramp's ends, the upper one with its unit; null: no reading. */
  readonly ends: readonly [low: string, high: string] | null;
  /** Stacked from the top, each from the lowest to the highest colour. */
  readonly ramps: readonly (readonly string[])[];
  /** Pixels per metre. */
  readonly scale: number;
}

/** Draws the footer into a strip of `width` × FOOTER_PX, from the origin. */
export function drawFooter(
  context: CanvasRenderingContext2D,
  width: number,
  footer: Footer,
  { ink, surface }: { readonly ink: string; readonly surface: string },
): void {
  context.fillStyle = surface;
  context.fillRect(0, 0, width, FOOTER_PX);
  context.fillStyle = ink;
  context.strokeStyle = ink;
  context.textBaseline = 'middle';
  const right = width - EDGE_PX;

  context.font = `600 ${FONT}`;
  context.fillText(footer.title, EDGE_PX, 18);
  context.font = `500 ${FONT}`;
  context.textAlign = 'right';
  context.fillText(footer.time, right, 18);

  const middle = 40;
  const bar = scaleBar(footer.scale, LONGEST_BAR_PX);
  const length = written(lengthText(bar.metres));
  context.fillText(length, right, middle);
  const end = right - context.measureText(length).width - GAP_PX;
  context.textAlign = 'left';
  context.lineWidth = 2;
  context.beginPath();
  context.moveTo(end - bar.pixels, middle - 4);
  context.lineTo(end - bar.pixels, middle + 3);
  context.lineTo(end, middle + 3);
  context.lineTo(end, middle - 4);
  context.stroke();

  if (!footer.ends) return;
  const [low, high] = footer.ends;
  context.fillText(low, EDGE_PX, middle);
  const left = EDGE_PX + context.measureText(low).width + GAP_PX;
  drawRamp(context, left, middle - RAMP_PX.height / 2, footer);
  context.fillStyle = ink;
  context.fillText(high, left + RAMP_PX.width + GAP_PX, middle);
}

function drawRamp(
  context: CanvasRenderingContext2D,
  x: number,
  y: number,
  { ramps }: Footer,
): void {
  const { width, height } = RAMP_PX;
  const each = height / ramps.length;
  ramps.forEach((stops, index) => {
    const gradient = context.createLinearGradient(x, 0, x + width, 0);
    stops.forEach((stop, place) => {
      gradient.addColorStop(place / (stops.length - 1), stop);
    });
    context.fillStyle = gradient;
    context.fillRect(x, y + index * each, width, each);
  });
  context.lineWidth = 1;
  context.strokeRect(x - 0.5, y - 0.5, width + 1, height + 1);
}

/** The current view's URL; the address bar lags behind it, and waits during playback. */
export function viewAddress(parameters: Readonly<Record<string, string>> = {}): string {
  const url = new URL(window.location.href);
  for (const [name, value] of Object.entries(parameters)) url.searchParams.set(name, value);
  url.hash = toFragment(store.get().view);
  return url.href;
}

/** Copies the view's URL; false if there is no clipboard or it refused. */
export async function copyLink(): Promise<boolean> {
  // Only secure contexts have a clipboard, and a greenhouse's plain http is none; the type claims
  // that it always exists.
  const clipboard = navigator.clipboard as Clipboard | undefined;
  if (!clipboard) return false;
  return clipboard.writeText(viewAddress()).then(
    () => true,
    () => false,
  );
}

const SHIFT_S = 8 * 3_600;
/** Longest period that the bridge reports on. */
const LONGEST_S = 31 * 86_400;

/** URL of the shift report, for the period chosen on the time bar, else the last eight hours. */
export function reportLink(): string {
  const state = store.get();
  const now = rosNow(state, pageNow());
  const query = new URLSearchParams({ lang: LANGUAGE, time_zone: timeZone() });
  if (now !== null) {
    const { period } = state.view;
    const oldest = state.twin.remembered.value?.reach?.from ?? null;
    const { from, to } = reported(isChosen(period) ? spanOf(period, now, oldest) : null, now);
    query.set('from', String(from));
    query.set('to', String(to));
  }
  return `api/report.html?${query.toString()}`;
}

/** The report's span in whole seconds, clipped to now and `LONGEST_S`. */
export function reported(span: Span | null, now: number): Span {
  const to = Math.max(1, Math.floor(Math.min(span?.to ?? now, now)));
  const from = Math.floor(span?.from ?? to - SHIFT_S);
  return { from: Math.max(0, to - LONGEST_S, Math.min(from, to - 1)), to };
}
