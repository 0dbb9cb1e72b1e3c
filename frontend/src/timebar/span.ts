/** The stretch of time that the bar has now, and the twin's time. */
import { now } from '../clock';
import { type Span, spanOf } from '../domain/period';
import { act, type AppState, store } from '../store/app';
import { rosNow } from '../store/moment';
import { selectIsRecorded } from '../store/origin';
import { S } from '../strings';

/** What is drawn is what was fetched; until then it is what was asked for. */
export function barSpan(state: AppState, nowS: number): Span {
  const { value } = state.twin.remembered;
  if (value && value.to > value.from) return value;
  const { from, to } = spanOf(state.view.period, nowS, null);
  return { from, to: Math.max(to, from + 1) };
}

/** The twin's time now, ROS seconds; null: nobody knows. */
export const twinNow = (): number | null => rosNow(store.get(), now());

/** What the end of the bar is called: of a recording it is no present, nor while nothing comes. */
export const newestWord = (): string => {
  const { phase } = store.get().twin;
  if (phase !== 'live') return S.phase[phase];
  return selectIsRecorded(store.get()) ? S.origin.recorded : S.timebarLive;
};

export function backToLive(): void {
  act({ type: 'moment', moment: null });
}
