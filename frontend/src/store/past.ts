/** Fetches the greenhouse's state and field as of the requested moment. */
import { Refusal } from '../contract/api';
import { fetchStateAt } from '../contract/past';
import type { Field } from '../contract/types';
import { snapshotOf } from '../domain/twin';
import { type AppState, keepFetched, receive, store } from './app';
import { PAGE } from './create';
import { sourceOf } from './derived';
import { boxOfPins, fetchHeat, fieldResolution } from './heat';
import { selectLatest, selectPast } from './moment';
import { DRAG_PACE_MS, failed, type Fetched, NOTHING, ready, type FetchTask } from './fetcher';
import { NO_HOUSE, type Past, withPast } from './twin';

/**
 * How long the previous state stays, under its own label, while the first moment is fetched: most
 * answers arrive before an empty page would show.
 */
const PATIENCE_MS = 300;

export function startPast(signal = PAGE): void {
  let patience: ReturnType<typeof setTimeout> | undefined;
  let receivedOn = 0;

  const show = (past: Past): void => {
    clearTimeout(patience);
    receive(withPast(past));
  };
  const showNothing = (at: number): void => show({ at, house: NO_HOUSE });
  const losePatience = (): void => {
    const { moment } = store.get().view;
    if (moment !== null) showNothing(moment);
  };
  const onError = (message: string, isLasting: boolean): void => {
    const { moment } = store.get().view;
    if (moment === null) return;
    if (selectPast(store.get()) === null || isLasting) showNothing(moment);
    receive({ pastFault: { at: moment, message, isLasting } });
  };

  const task = (state: AppState): FetchTask<Past> | null => {
    const { moment } = state.view;
    const past = selectPast(state);
    if (moment === null) {
      clearTimeout(patience);
      patience = undefined;
      if (past) receive(withPast(null));
      return null;
    }
    const fault = state.twin.pastFault;
    if (fault && fault.at !== moment) receive({ pastFault: null });
    if (!past && !selectLatest(state).snapshot) showNothing(moment);
    else if (!past) patience ??= setTimeout(losePatience, PATIENCE_MS);
    else patience = undefined;
    const { epoch, socket } = state.twin.connection;
    // Each connection refetches: it may lead to another server, or more data has arrived.
    if (socket.kind === 'open') receivedOn = epoch;
    return taskFor(state, moment, receivedOn);
  };
  const parts = ({ view, twin }: AppState): readonly unknown[] => [view, twin];
  const options = { paceMs: DRAG_PACE_MS, isDragged: true, parts, onValue: show, onError };
  keepFetched<Past>(options, task, signal);
  signal.addEventListener('abort', () => clearTimeout(patience));
}

function taskFor(state: AppState, at: number, epoch: number): FetchTask<Past> {
  const { sensor } = state.view;
  const source = sourceOf(state);
  const resolution = fieldResolution(selectLatest(state).snapshot);
  return {
    key: `${epoch}|${at}|${sensor}|${resolution}|${source}`,
    run: async (signal) => {
      const then = fetchStateAt(at, signal).then((latest) => {
        const before = selectPast(store.get())?.house.snapshot ?? null;
        // In milliseconds of ROS time: only differences count.
        const snapshot = snapshotOf(latest, at * 1000, before);
        return { snapshot, health: latest.health };
      });
      // The server refuses an estimate without a tag, so that has to be known first.
      const known = source === 'estimate' ? await then : null;
      const isNowhere = known && !boxOfPins(known.snapshot);
      // Both or neither: no moment shows the field of another one.
      const [{ snapshot, health }, field] = await Promise.all([
        then,
        isNowhere
          ? NOTHING
          : fetchHeat(source, { sensor, resolution, at }, signal).then(
              ready,
              (error: unknown): Fetched<Field> => {
                // A temporary failure is retried together with the state.
                if (!(error instanceof Refusal) || error.status !== 400) throw error;
                return failed(error.message);
              },
            ),
      ]);
      return {
        at,
        house: { ...NO_HOUSE, snapshot, health, field: boxOfPins(snapshot) ? field : NOTHING },
      };
    },
  };
}
