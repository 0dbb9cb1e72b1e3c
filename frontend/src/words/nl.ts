/** Dutch. */
import { ALARMS } from './nl/alarms';
import { CHARTS } from './nl/charts';
import { HEALTH } from './nl/health';
import { MAP } from './nl/map';
import { PAGE } from './nl/page';
import { PAST } from './nl/past';
import { TAGS } from './nl/tags';
import type { Words } from './shape';

export const DUTCH: Words = { ...PAGE, ...HEALTH, ...ALARMS, ...MAP, ...TAGS, ...CHARTS, ...PAST };
