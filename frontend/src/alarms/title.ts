/** The name of the page's tab: how many alarms are active, and which moment is shown. */
import { rosText } from '../domain/time';
import { store } from '../store/app';
import { selectIsRecorded, selectShown } from '../store/moment';
import { S } from '../strings';
import { alarmList } from './watch';

export const titleOf = (count: number, moment: number | null, isRecorded = false): string => {
  const shown = moment === null ? S.product : S.pastTitle(rosText(moment));
  const title = isRecorded ? `${S.origin.recorded} · ${shown}` : shown;
  return count === 0 ? title : `(${count}) ${title}`;
};

/** Keeps it so; returns the way to stop. */
export function startTitle(): () => void {
  const update = (): void => {
    const state = store.get();
    const { moment } = selectShown(state);
    const title = titleOf(alarmList.get().active.length, moment, selectIsRecorded(state));
    if (document.title !== title) document.title = title;
  };
  update();
  const stops = [store.subscribe(update), alarmList.subscribe(update)];
  return () => {
    for (const stop of stops) stop();
  };
}
