/** Spanish. */
import { ALARMS, HEALTH } from './es/alarms';
import { CHARTS, MAP, TAGS } from './es/map';
import { PAGE, PAST } from './es/page';
import type { Words } from './shape';

export const SPANISH: Words = {
  ...PAGE,
  ...HEALTH,
  ...ALARMS,
  ...MAP,
  ...TAGS,
  ...CHARTS,
  ...PAST,
};
