/** English: the reference catalogue, whose shape the other languages follow. */
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
