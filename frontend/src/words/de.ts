/** German. */
import { ALARMS } from './de/alarms';
import { CHARTS } from './de/charts';
import { HEALTH } from './de/health';
import { MAP } from './de/map';
import { PAGE } from './de/page';
import { PAST } from './de/past';
import { TAGS } from './de/tags';
import type { Words } from './shape';

export const GERMAN: Words = { ...PAGE, ...HEALTH, ...ALARMS, ...MAP, ...TAGS, ...CHARTS, ...PAST };
