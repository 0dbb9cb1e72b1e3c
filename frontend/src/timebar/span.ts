/** The stretch of time that the bar has now, and the twin's time. */
import { now } from '../clock';
import { spanOf, type Span } from '../domain/period';
import { store, type AppState } from '../store/app';
import { rosNow } from '../store/moment';

/** What is drawn is what was fetched; until then it is what was asked for. */
export function barSpan(state: AppState, nowS: number): Span {
  const { value } = state.twin.remembered;
  if (value && value.to > value.from) return value;
  const { from, to } = spanOf(state.view.period, nowS, null);
  return { from, to: Math.max(to, from + 1) };
}

/** The twin's time now, ROS seconds; null: nobody knows. */
export const twinNow = (): number | null => rosNow(store.get(), now());
