/** ROS times as seconds, and for a person to read. */
import type { WireTime } from '../contract/types';
import { LOCALE } from '../strings';
import { clockText } from './format';

/** Stamps before September 2001 are no dates: a simulation counts from its own beginning. */
const FIRST_DATE_S = 1e9;

export const hasDate = (at: number): boolean => at >= FIRST_DATE_S;

export const secondsOf = ({ sec, nanosec }: WireTime): number => sec + nanosec / 1e9;

const date = new Intl.DateTimeFormat(LOCALE, { day: 'numeric', month: 'short', year: 'numeric' });

/** "14 Nov 2026, 03:12:40" on the operator's own clock; of a simulation "sim 01:23:45". */
export function rosText(at: number): string {
  return hasDate(at) ? dateText(Math.floor(at) * 1000) : simText(at);
}

/** "14 Nov": for where the year stands beside it, or goes without saying. */
export const dayFormat = new Intl.DateTimeFormat(LOCALE, { day: 'numeric', month: 'short' });

/** "14 Nov, 03:12:40", as `rosText` without the year. */
export function shortRosText(at: number): string {
  const epochMs = Math.floor(at) * 1000;
  return hasDate(at) ? `${dayFormat.format(epochMs)}, ${clockText(epochMs)}` : simText(at);
}

/** "14 Nov 2026, 03:12:40" on the operator's own clock. */
export const dateText = (epochMs: number): string =>
  `${date.format(epochMs)}, ${clockText(epochMs)}`;

function simText(at: number): string {
  const seconds = Math.floor(at);
  const parts = [Math.floor(seconds / 3_600), Math.floor(seconds / 60) % 60, seconds % 60];
  return `sim ${parts.map((part) => String(part).padStart(2, '0')).join(':')}`;
}
