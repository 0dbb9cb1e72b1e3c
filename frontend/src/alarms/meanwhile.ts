/** Alarms that have come since somebody looks at another moment. */
import { store } from '../store/app';
import { createStore } from '../store/create';
import { calling, type Item } from './list';
import { alarmList, onNews } from './watch';

/** The worst first; without those that were acknowledged or shelved since, or are resolved. */
export const meanwhile = createStore<readonly Item[], readonly Item[]>([], (before, next) =>
  next.length === before.length && next.every((item, index) => item === before[index])
    ? before
    : next,
);

export function startMeanwhile(): () => void {
  let ids: ReadonlySet<string> = new Set();
  const update = (): void => {
    if (store.get().view.moment === null) ids = new Set();
    meanwhile.dispatch(calling(alarmList.get()).filter(({ alarm }) => ids.has(alarm.id)));
  };
  const stops = [
    onNews(({ raised }) => {
      if (store.get().view.moment === null) return;
      ids = new Set([...ids, ...raised.map(({ alarm }) => alarm.id)]);
      update();
    }),
    alarmList.subscribe(update),
    store.subscribe(update),
  ];
  update();
  return () => {
    for (const stop of stops) stop();
  };
}
