/** What there is to show on the map, and what stands on it. */
import type { Field } from '../contract/types';
import { fieldCorners } from '../domain/field';
import { holds, isPossible } from '../domain/farOff';
import { reachOfTags, type Tag } from '../domain/twin';
import type { Box } from '../geometry/clear';
import { boundsOf, corners, type Bounds, type MapPoint } from '../geometry/coordinates';
import { memoOne } from '../domain/memo';
import type { House } from '../store/twin';

export interface Content {
  readonly bounds: Bounds;
  readonly pins: readonly MapPoint[];
}

const NO_TAGS: readonly Tag[] = [];

/** A planter that was seen by a robot that is lost does not make the map wider. */
const places = memoOne((tags: readonly Tag[]) => {
  const reach = reachOfTags(tags);
  const pins = tags.flatMap((tag) => (tag.at ? [tag.at] : []));
  const planters = tags.flatMap((tag) => tag.footprint);
  const bounds = boundsOf([...pins, ...planters.filter((corner) => holds(reach, corner))]);
  return { pins, corners: bounds ? corners(bounds) : [] };
});

/**
 * What a fit shows: everything pinned or planted, and the known part of the floor plan. Where there
 * is no plan, the heat map, whose grid is the same for every sensor, so that a switch moves nothing;
 * while the next one is on its way, the last one's stands in for it.
 */
export function contentOf({ snapshot, map }: House, field: Field | null): Content | null {
  const { pins, corners: planted } = places(snapshot?.tags ?? NO_TAGS);
  const known = (map.value?.known ?? []).filter(isPossible);
  // A field whose tags are gone is one of a twin before this one.
  const hasField = field && planted.length > 0 && known.length === 0;
  const bounds = boundsOf([...planted, ...(hasField ? fieldCorners(field) : []), ...known]);
  return bounds && { bounds, pins };
}

/** Both, as one. */
export function together(a: Content | null, b: Content | null): Content | null {
  if (!a || !b) return a ?? b;
  const bounds = boundsOf([...corners(a.bounds), ...corners(b.bounds)]);
  return bounds && { bounds, pins: [...a.pins, ...b.pins] };
}

/** What in the page stands on the map and hides a pin: buttons, scale bar, notices. */
const OVER_MAP = '[data-over-map]';

/** The boxes in the map view that something of the page covers. */
export function coveredBoxes(element: HTMLElement): Box[] {
  const map = element.getBoundingClientRect();
  return [...(element.parentElement?.querySelectorAll(OVER_MAP) ?? [])].flatMap((each) => {
    const { left, top, right, bottom, width, height } = each.getBoundingClientRect();
    if (width === 0 || height === 0) return [];
    return [
      {
        left: left - map.left,
        top: top - map.top,
        right: right - map.left,
        bottom: bottom - map.top,
      },
    ];
  });
}

/** Calls back when something that stands on the map may have changed its size; returns the end. */
export function watchCovered(element: HTMLElement, onChange: () => void): () => void {
  const observer = new ResizeObserver(onChange);
  for (const each of element.parentElement?.querySelectorAll('.map-controls, .map-foot') ?? []) {
    observer.observe(each);
  }
  return () => {
    observer.disconnect();
  };
}
