/** The period that the page opens on, where neither link nor person has chosen one. */
import type { Span } from '../domain/period';
import { act, store } from './app';
import { DEFAULT_VIEW, SHORT_PERIOD } from './view';

/** In a day's bar, memory that is shorter than this is squeezed into its right end, seconds. */
const SHORT_S = 10_800;
/** How long SHORT_PERIOD is, seconds. */
const HOUR_S = 3_600;

/** Whether the last hour tells more than the last day; a moment to show has to be in it. */
function isShort(reach: Span, moment: number | null): boolean {
  return reach.to - reach.from < SHORT_S && (moment === null || moment >= reach.to - HOUR_S);
}

/** Decides once, as soon as it is known how far memory reaches: no period changes by itself later. */
export function startOpening(): () => void {
  let opensShort: boolean | null = null;
  const update = (): void => {
    const { twin, view } = store.get();
    const reach = twin.remembered.value?.reach;
    if (reach) opensShort ??= isShort(reach, view.moment);
    if (opensShort && view.period === DEFAULT_VIEW.period) {
      act({ type: 'period', period: SHORT_PERIOD });
    }
  };
  update();
  return store.subscribe(update);
}
