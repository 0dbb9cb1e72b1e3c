/** English, whose words say what there is to be said: the other languages have their shape. */
import { ALARMS, HEALTH } from './en/alarms';
import { CHARTS, MAP, TAGS } from './en/map';
import { PAGE, PAST } from './en/page';

export const ENGLISH = {
  ...PAGE,
  ...HEALTH,
  ...ALARMS,
  ...MAP,
  ...TAGS,
  ...CHARTS,
  ...PAST,
} as const;
