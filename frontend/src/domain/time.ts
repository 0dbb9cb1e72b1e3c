import { LOCALE } from '../strings';
import { clockText } from './format';

/** A reading is drawn at full strength up to this age, in seconds... */
const FADE_FROM_S = 60;
/** ...and at its faintest from this age on. */
const FADE_TO_S = 1800;
const FAINTEST = 0.35;

/** A time, ROS seconds. */
export type When = number | 'never' | 'unknown';

/** A stamp may be this far ahead of the latest state, which comes after it, seconds. */
const AHEAD_S = 10;

/** Seconds since then; null: never, not known, or in the future, because the clock was set back. */
export const ageSeconds = (at: When | null, now: number | null): number | null =>
  typeof at !== 'number' || now === null || at > now + AHEAD_S ? null : Math.max(0, now - at);

/** Age steps for text, which cannot fade as a picture does. */
export function ageStep(age: number | null): 'fresh' | 'fading' | 'old' {
  if (age === null || age >= FADE_TO_S) return 'old';
  return age < FADE_FROM_S ? 'fresh' : 'fading';
}

/** Opacity for an age, 0.35 to 1, linear in its logarithm; null: faintest. */
export function freshness(age: number | null): number {
  if (age === null) return FAINTEST;
  const share =
    Math.log(Math.max(age, FADE_FROM_S) / FADE_FROM_S) / Math.log(FADE_TO_S / FADE_FROM_S);
  return 1 - (1 - FAINTEST) * Math.min(1, share);
}

/** Stamps before September 2001 are no dates: a simulation counts from its own beginning. */
const FIRST_DATE_S = 1e9;

export const hasDate = (at: number): boolean => at >= FIRST_DATE_S;

/** ISO 8601, for programs: the same ROS time as in a bag. */
export const isoText = (at: number): string => new Date(Math.round(at * 1000)).toISOString();

const date = new Intl.DateTimeFormat(LOCALE, { day: 'numeric', month: 'short', year: 'numeric' });

/** "14 Nov 2026, 03:12:40" on the operator's own clock; of a simulation "sim 01:23:45". */
export function rosText(at: number): string {
  return hasDate(at) ? dateText(Math.floor(at) * 1000) : simText(at);
}

/** "14 Nov": for use beside a year, or if the year is obvious. */
export const dayFormat = new Intl.DateTimeFormat(LOCALE, { day: 'numeric', month: 'short' });

/** "14 Nov, 03:12:40", as `rosText` without the year. */
export function shortRosText(at: number): string {
  const epochMs = Math.floor(at) * 1000;
  return hasDate(at) ? `${dayFormat.format(epochMs)}, ${clockText(epochMs)}` : simText(at);
}

/** "14 Nov 2026, 03:12:40" on the operator's own clock. */
export const dateText = (epochMs: number): string =>
  `${date.format(epochMs)}, ${clockText(epochMs)}`;

const two = (value: number): string => String(value).padStart(2, '0');

/** "1:02:03" since a simulation began. */
export function countText(seconds: number): string {
  const s = Math.floor(seconds);
  return [Math.floor(s / 3_600), two(Math.floor(s / 60) % 60), two(s % 60)].join(':');
}

const simText = (at: number): string => `sim ${countText(at).padStart(8, '0')}`;

/** Lengths that end now, in seconds. */
const LENGTHS = { hour: 3_600, day: 86_400, week: 604_800, month: 2_592_000 } as const;

/** Periods without parameters, in the order in which they are offered. */
export const PERIOD_KINDS = ['hour', 'day', 'week', 'month', 'all'] as const;

/** "own" is between two moments, ROS seconds; the others end now, and "all" begins with the history. */
export type Period =
  | { readonly kind: (typeof PERIOD_KINDS)[number] }
  | { readonly kind: 'own'; readonly from: number; readonly to: number };

/** From one moment to another, ROS seconds. */
export interface Span {
  readonly from: number;
  readonly to: number;
}

/**
 * A period's span; one that ends now begins with the history if that is shorter. `now` is the twin's
 * time, `oldest` the beginning of the history; null: not known.
 */
export function spanOf(period: Period, now: number, oldest: number | null): Span {
  if (period.kind === 'own') return { from: period.from, to: period.to };
  const longest = oldest === null ? LENGTHS.day : Infinity;
  const length = period.kind === 'all' ? longest : LENGTHS[period.kind];
  return { from: Math.max(0, Math.min(Math.max(oldest ?? 0, now - length), now - 1)), to: now };
}

export const endsNow = (period: Period): boolean => period.kind !== 'own';
