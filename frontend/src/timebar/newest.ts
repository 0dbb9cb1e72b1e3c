import { store } from '../store/app';
import { selectIsRecorded } from '../store/origin';
import { S } from '../strings';

/** What the end of the bar is called: of a recording it is no present, nor while nothing comes. */
export const newestWord = (): string => {
  const { phase } = store.get().twin;
  if (phase !== 'live') return S.phase[phase];
  return selectIsRecorded(store.get()) ? S.origin.recorded : S.timebarLive;
};
