/** A server's answer, kept up to date while the page is visible. */
import { useMemo } from 'react';

import { pause } from '../clock';
import { answer } from '../contract/api';
import type { SensorsFile } from '../contract/types';
import { type Catalogue, cataloguesOf, NO_CATALOGUES } from '../domain/sensors';
import { type Fetched, useFetched } from '../store/fetcher';
import { openStorage, readSettings } from '../store/settings';
import { useTicking } from '../widgets/useNow';

/** Pace, ms: the path may change faster than a reader can follow. */
const SETTLE_MS = 300;

/** Fetches at once, when `path` or `news` changes, and at an interval, ms; the last answer stays. */
export function useAnswer<T extends object>(
  path: string,
  needs: readonly (keyof T & string)[],
  everyMs: number,
  news = '',
): Fetched<T> {
  const turn = useTicking((at) =>
    document.visibilityState === 'visible' ? String(Math.floor(at / everyMs)) : null,
  );
  return useFetched<T>(
    turn === null
      ? null
      : {
          key: `${turn}|${news}`,
          group: path,
          run: async (signal) => {
            await pause(SETTLE_MS);
            return answer<T>(signal, path, needs);
          },
        },
    SETTLE_MS,
  );
}

const EVERY_MS = 600_000;

/** Names and formats of readings: the sensors in force, in the reader's unit. */
export function useSensors(): Catalogue {
  const file = useAnswer<SensorsFile>(
    'api/sensors',
    ['ramp', 'fallback', 'sensors'],
    EVERY_MS,
  ).value;
  return useMemo(
    () => (file ? cataloguesOf(file, readSettings(openStorage()).unit) : NO_CATALOGUES).day,
    [file],
  );
}
