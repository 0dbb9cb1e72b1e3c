/** English, whose words say what there is to be said: the other languages have their shape. */
import { ALARMS } from './en/alarms';
import { CHARTS } from './en/charts';
import { HEALTH } from './en/health';
import { MAP } from './en/map';
import { PAGE } from './en/page';
import { PAST } from './en/past';
import { TAGS } from './en/tags';

export const ENGLISH = {
  ...PAGE,
  ...HEALTH,
  ...ALARMS,
  ...MAP,
  ...TAGS,
  ...CHARTS,
  ...PAST,
} as const;
