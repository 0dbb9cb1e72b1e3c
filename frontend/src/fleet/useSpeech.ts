/** What readings are named and written with: the sensors in force, and the reader's unit. */
import { useMemo } from 'react';

import type { Speech } from '../alarms/words';
import type { SensorsFile } from '../contract/types';
import { cataloguesOf, NO_CATALOGUES } from '../domain/sensors';
import { openStorage, readSettings } from '../store/settings';
import { useAnswer } from './useAnswer';

const EVERY_MS = 600_000;

export function useSpeech(): Speech {
  const file = useAnswer<SensorsFile>('api/sensors', EVERY_MS).value;
  return useMemo(
    () => ({
      sensors: (file ? cataloguesOf(file) : NO_CATALOGUES).day,
      unit: readSettings(openStorage()).unit,
    }),
    [file],
  );
}
