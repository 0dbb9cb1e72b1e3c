/** What goes on about alarms beside the components; icon, sound and notifications are begun apart. */
import { startMeanwhile } from './meanwhile';
import { startOwn } from './own';
import { startTitle } from './title';
import { startVoices } from './voices';
import { startAlarms } from './watch';

export function startAlarmsAndTelling(storage: Pick<Storage, 'getItem' | 'setItem'>): () => void {
  // What was kept comes first: nothing is told of that was acknowledged on another day.
  const stops = [startOwn(storage), startAlarms(), startTitle(), startVoices(), startMeanwhile()];
  return () => {
    for (const stop of stops.reverse()) stop();
  };
}
