/** Dutch. */
import { ALARMS, HEALTH } from './nl/alarms';
import { CHARTS, MAP, TAGS } from './nl/map';
import { PAGE, PAST } from './nl/page';
import type { Words } from './shape';

export const DUTCH: Words = { ...PAGE, ...HEALTH, ...ALARMS, ...MAP, ...TAGS, ...CHARTS, ...PAST };
