/** A reading is drawn at full strength up to this age, in seconds... */
const FADE_FROM_S = 60;
/** ...and at its faintest from this age on. */
const FADE_TO_S = 1800;
const FAINTEST = 0.35;

/**
 * How ages go on in what is shown: with the browser's clock; or not, as of one moment (a past
 * one, ms on the monotonic clock); or nobody knows.
 */
export type Ageing =
  | { readonly kind: 'growing' }
  | { readonly kind: 'as-of'; readonly at: number }
  | { readonly kind: 'unknown' };

export const GROWING: Ageing = { kind: 'growing' };
export const AGES_UNKNOWN: Ageing = { kind: 'unknown' };

/** When something was, ms on the monotonic clock. */
export type When = number | 'never' | 'unknown';

/** Seconds since then; null: it never was, or nobody knows. */
export function ageSeconds(
  observedAt: When | null,
  now: number,
  ageing: Ageing = GROWING,
): number | null {
  if (typeof observedAt !== 'number' || ageing.kind === 'unknown') return null;
  const asOf = ageing.kind === 'as-of' ? ageing.at : now;
  return Math.max(0, asOf - observedAt) / 1000;
}

/** How old something looks in text, which does not fade as a picture does. */
export function ageStep(age: number | null): 'fresh' | 'fading' | 'old' {
  if (age === null || age >= FADE_TO_S) return 'old';
  return age < FADE_FROM_S ? 'fresh' : 'fading';
}

/** How strongly to draw something of that age, 0.35 to 1, even in ratios of age; null: faintest. */
export function freshness(age: number | null): number {
  if (age === null) return FAINTEST;
  const share =
    Math.log(Math.max(age, FADE_FROM_S) / FADE_FROM_S) / Math.log(FADE_TO_S / FADE_FROM_S);
  return 1 - (1 - FAINTEST) * Math.min(1, share);
}
