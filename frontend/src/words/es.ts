/** Spanish. */
import { ALARMS } from './es/alarms';
import { CHARTS } from './es/charts';
import { HEALTH } from './es/health';
import { MAP } from './es/map';
import { PAGE } from './es/page';
import { PAST } from './es/past';
import { TAGS } from './es/tags';
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
