/** Judgements of the bridge. Verdicts are given, not derived from readings. */
import type { HealthReason, Judgement, Verdict } from '../contract/types';
import { VERDICTS } from '../domain/health';

const worst = (verdicts: readonly Verdict[]): Verdict =>
  VERDICTS.find((verdict) => verdicts.includes(verdict)) ?? 'unknown';

export const reason = (over: Partial<HealthReason> = {}): HealthReason => ({
  kind: 'range',
  verdict: 'critical',
  sensor: 'temperature',
  value: 6.6,
  limit: 10,
  since: 100,
  ...over,
});

/** For a value that is back inside its limit: the value it must pass. */
export const held = (release?: number): Pick<HealthReason, 'release'> =>
  release === undefined ? {} : { release };

/** For each tag a verdict without a reason, or reasons, of which the worst decides. */
export function judgement(
  said: Readonly<Record<string, Verdict | readonly HealthReason[]>>,
  day: Judgement['house']['day'] = { is_day: true, source: 'assumed' },
  patrol: Judgement['house']['patrol'] = { interval_s: null, last_scan: null, overdue: 0 },
): Judgement {
  const tags = Object.fromEntries(
    Object.entries(said).map(([id, each]) => {
      const reasons = typeof each === 'string' ? [] : each;
      const verdict = typeof each === 'string' ? each : worst(each.map((reason) => reason.verdict));
      return [id, { verdict, reasons }];
    }),
  );
  const verdict = worst(Object.values(tags).map((tag) => tag.verdict));
  return { house: { verdict, reasons: [], day, patrol }, tags };
}

export const NOBODY: Judgement = judgement({});
