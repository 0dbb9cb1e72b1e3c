/** Zoom: the part chosen in a chart becomes the period; time bar and link follow. */
import type { Period, Span } from '../domain/time';
import { act, store, useApp } from '../store/app';
import { createStore, useSelected } from '../store/create';
import { roundedMoment } from '../store/view';

/** Shortest useful period, seconds. */
export const SHORTEST_S = 10;

/** The period before the first zoom; null: not zoomed. */
export const wholePeriod = createStore<Period | null>(null);

/** Widened around its middle to the shortest period; never before ROS time 0. */
export function zoomedSpan({ from, to }: Span): Span {
  const middle = (from + to) / 2;
  const half = Math.max(to - from, SHORTEST_S) / 2;
  const start = Math.max(0, middle - half);
  // The precision of a link.
  return {
    from: roundedMoment(start),
    to: roundedMoment(Math.max(start + SHORTEST_S, middle + half)),
  };
}

export function zoomTo(span: Span): void {
  const { period } = store.get().view;
  if (period.kind !== 'own' || wholePeriod.get() === null) wholePeriod.set(period);
  act({ period: { kind: 'own', ...zoomedSpan(span) } });
}

/** In (below 1) or out around the middle, but never beyond now. */
export function zoomBy(span: Span, factor: number, now: number): void {
  const half = ((span.to - span.from) * factor) / 2;
  const to = Math.min(now, (span.from + span.to) / 2 + half);
  zoomTo({ from: to - 2 * half, to });
}

export function zoomBack(): void {
  const period = wholePeriod.get();
  if (!period) return;
  wholePeriod.set(null);
  act({ period });
}

export function useZoomed(): boolean {
  const whole = useSelected(wholePeriod);
  const isOwn = useApp((state) => state.view.period.kind === 'own');
  return isOwn && whole !== null;
}
