/** Moments as the page over all greenhouses writes them. */
import { timeOfDay } from '../clock';
import { LOCALE } from '../strings';
import type { Time } from './sites';

const clockTime = new Intl.DateTimeFormat(LOCALE, { timeStyle: 'medium' });
const dateAndTime = new Intl.DateTimeFormat(LOCALE, { dateStyle: 'medium', timeStyle: 'short' });
const DAY_MS = 86_400_000;

/** Of today the time of day is enough. */
export function timeText(at: number): string {
  return (Math.abs(timeOfDay() - at) < DAY_MS / 2 ? clockTime : dateAndTime).format(at);
}

export const ms = ({ sec, nanosec }: Time): number => sec * 1000 + nanosec / 1e6;

/** When that was, so many seconds ago, to the second. */
export const silentAt = (lagS: number): number =>
  Math.round((timeOfDay() - lagS * 1000) / 1000) * 1000;
