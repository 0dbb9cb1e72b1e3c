import { useEffect, useState } from 'react';

import { useApp } from '../store/app';
import { createFetcher } from '../store/fetcher';
import type { Fetched } from '../store/twin';

/** What the twin says of its estimate changes slowly. */
const EVERY_MS = 10_000;

/**
 * What the bridge answers about the sensor in view, asked again now and then while it is connected:
 * one question at a time, beside the frames. Of another sensor nothing is left.
 */
export function useAsked<T>(ask: (sensor: string, signal: AbortSignal) => Promise<T>): Fetched<T> {
  const sensor = useApp((state) => state.view.sensor);
  const isOpen = useApp((state) => state.twin.connection.socket.kind === 'open');
  const [answer, setAnswer] = useState<{ readonly of: string; readonly got: Fetched<T> } | null>(
    null,
  );
  useEffect(() => {
    if (!isOpen) return undefined;
    let ticks = 0;
    const fetcher = createFetcher<T>({
      paceMs: EVERY_MS,
      onValue: (value) => {
        setAnswer({ of: sensor, got: { value, state: 'ready', message: '' } });
      },
      onError: (message) => {
        setAnswer((last) => ({
          of: sensor,
          got: {
            value: last?.of === sensor ? last.got.value : null,
            state: 'failed',
            message,
          },
        }));
      },
    });
    const want = (): void => {
      fetcher.want({
        key: String(ticks),
        group: sensor,
        run: (signal) => ask(sensor, signal),
      });
      ticks += 1;
    };
    want();
    const timer = setInterval(want, EVERY_MS);
    return () => {
      clearInterval(timer);
      fetcher.want(null);
    };
  }, [ask, sensor, isOpen]);
  return answer?.of === sensor ? answer.got : { value: null, state: 'waiting', message: '' };
}
