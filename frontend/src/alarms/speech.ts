/** In whose words alarms are told: the sensors in force, and the operator's unit. */
import type { AppState } from '../store/app';
import { selectCatalogue } from '../store/derived';
import { memoLast } from '../store/memo';
import type { Speech } from './words';

const speech = memoLast((sensors: Speech['sensors'], unit: Speech['unit']): Speech => ({
  sensors,
  unit,
}));

export const selectSpeech = (state: AppState): Speech =>
  speech(selectCatalogue(state), state.settings.unit);
