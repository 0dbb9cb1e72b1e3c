/** What screen readers are told of, beside what they are led to; of alarms see `alarms/voices.ts`. */
import { createVoice } from '../store/create';

/** The tag that a key has chosen. */
export const chosenTag = createVoice();
