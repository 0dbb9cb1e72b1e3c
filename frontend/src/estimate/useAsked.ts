import { useApp } from '../store/app';
import type { Fetched } from '../store/fetcher';
import { useFetched } from '../store/useFetched';
import { useTicking } from '../widgets/useNow';

/** What the twin says of its estimate changes slowly. */
const EVERY_MS = 10_000;

/**
 * What the bridge answers about the sensor in view, asked again now and then while it is connected:
 * one question at a time, beside the frames. Of another sensor nothing is left.
 */
export function useAsked<T>(ask: (sensor: string, signal: AbortSignal) => Promise<T>): Fetched<T> {
  const sensor = useApp((state) => state.view.sensor);
  const isOpen = useApp((state) => state.twin.connection.socket.kind === 'open');
  const turn = useTicking((at) => String(Math.floor(at / EVERY_MS)));
  const { value, ...rest } = useFetched<{ readonly of: string; readonly answer: T }>(
    isOpen
      ? {
          key: turn,
          group: sensor,
          run: async (signal) => ({ of: sensor, answer: await ask(sensor, signal) }),
        }
      : null,
    EVERY_MS,
  );
  return { ...rest, value: value?.of === sensor ? value.answer : null };
}
