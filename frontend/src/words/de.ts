/** German. */
import { ALARMS, HEALTH } from './de/alarms';
import { CHARTS, MAP, TAGS } from './de/map';
import { PAGE, PAST } from './de/page';
import type { Words } from './shape';

export const GERMAN: Words = { ...PAGE, ...HEALTH, ...ALARMS, ...MAP, ...TAGS, ...CHARTS, ...PAST };
