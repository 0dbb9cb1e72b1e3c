/** A stretch of time that the page looks at: the same for the time bar and for charts. */

/** Lengths that end now, in seconds. */
const LENGTHS = { hour: 3_600, day: 86_400, week: 604_800, month: 2_592_000 } as const;

/** Those without a number of their own, in the order in which they are offered. */
export const PERIOD_KINDS = ['hour', 'day', 'week', 'month', 'all'] as const;

/** "own" is between two moments, ROS seconds; the others end now, and "all" begins with memory. */
export type Period =
  | { readonly kind: (typeof PERIOD_KINDS)[number] }
  | { readonly kind: 'own'; readonly from: number; readonly to: number };

/** From one moment to another, ROS seconds. */
export interface Span {
  readonly from: number;
  readonly to: number;
}

/** A period's stretch. `now` is the twin's time, `oldest` what memory reaches back to; null: not known. */
export function spanOf(period: Period, now: number, oldest: number | null): Span {
  switch (period.kind) {
    case 'own':
      return { from: period.from, to: period.to };
    case 'all':
      return { from: Math.min(oldest ?? now - LENGTHS.day, now - 1), to: now };
    case 'hour':
    case 'day':
    case 'week':
    case 'month':
      return { from: Math.max(0, now - LENGTHS[period.kind]), to: now };
  }
}

/** Whether a period goes on with the time. */
export const endsNow = (period: Period): boolean => period.kind !== 'own';
