/** The bridge tests' table of states: the page words what the judge decides. */
import { readFileSync } from 'node:fs';
import { join } from 'node:path';

import { act as flush, render, screen } from '@testing-library/react';
import { beforeEach, expect, test, vi } from 'vitest';

import type { HealthReason, Verdict } from '../contract/types';
import { byCause } from '../domain/health';
import { act } from '../store/app';
import { withTag } from '../store/view';
import { judgement } from '../testing/health';
import { showTags } from '../testing/page';
import { readings, wireTag } from '../testing/tags';
import { HealthSummary } from './HealthSummary';
import { TagCard } from './TagCard';
import { TagTable } from './TagTable';

interface Case {
  readonly name: string;
  readonly readings: Readonly<Record<string, readonly [number | null, number | null]>>;
  readonly is_day?: boolean;
  readonly verdict: Verdict;
  readonly reasons: readonly (readonly [
    HealthReason['kind'],
    Verdict,
    string,
    number | null,
    number | null,
  ])[];
}

const TABLE = join(import.meta.dirname, '../../../tests/bridge/judge/verdicts.json');
const CASES = JSON.parse(readFileSync(TABLE, 'utf8')) as readonly Case[];
const WORDS: Readonly<Record<Verdict, string>> = {
  critical: 'Critical',
  stressed: 'Stressed',
  unknown: 'Unknown',
  healthy: 'Healthy',
};
/** What the words of each kind must contain. */
const SAYS: Readonly<Record<HealthReason['kind'], RegExp>> = {
  range: /, (below|above) [\d.,]+( \(critical\))?$/,
  reading_failed: /: (the sensor returns no value|not a plausible value)$/,
  scan_failed: /^Last scan failed: (not reachable|not readable)/,
  pest: /^(\d+ pests?|Pest) seen$/,
  old: /(^Not scanned|^No scan|: no(t| reading) ).* \(readings are valid for 10\u00a0min\)$/,
  changed: /changed/,
  silent: /silent/,
  stopped: /stopped/,
};

beforeEach(() => {
  vi.stubGlobal('fetch', () => Promise.reject(new Error('no server')));
});

test.each(CASES)('$name', (state) => {
  const values = Object.entries(state.readings).map(([name, [value]]) => [name, value] as const);
  const reported = state.reasons.map(([kind, verdict, sensor, value, limit]) => ({
    ...{ kind, verdict, sensor, value, limit },
    since: 0,
  }));
  const judged = judgement({ 7: reported.length > 0 ? reported : state.verdict });
  expect(judged.tags['7']?.verdict).toBe(state.verdict);
  showTags([wireTag({ tag_id: '7', readings: readings(Object.fromEntries(values)) })], judged);
  act(withTag('7'));
  render(
    <>
      <HealthSummary kiosk={false} />
      <TagCard tagId="7" />
      <TagTable />
    </>,
  );
  expect(screen.getByTestId('greenhouse-health').dataset['health']).toBe(state.verdict);
  expect(screen.getByTestId('tag-card').querySelector('header')?.textContent).toContain(
    WORDS[state.verdict],
  );
  const row = document.querySelector<HTMLElement>('tr[data-tag-id="7"]');
  expect(row?.dataset['health']).toBe(state.verdict);
  const lines = [...document.querySelectorAll('[data-testid=reasons] li')];
  const causes = byCause(reported);
  expect(lines).toHaveLength(causes.length);
  for (const reason of reported) {
    const { kind, verdict, sensor, value, limit } = reason;
    const at = causes.findIndex((own) => own.includes(reason));
    const line = lines[at];
    const isOne = causes[at]?.length === 1;
    expect(line?.children[1]?.textContent).toMatch(isOne ? SAYS[kind] : /^Air too (damp|dry): /);
    const worst = causes[at]?.[0].verdict;
    expect(line?.querySelector('.health-mark')?.getAttribute('data-health')).toBe(worst ?? verdict);
    if (kind !== 'range' || value === null || limit === null) continue;
    if (isOne) expect(line?.textContent).toContain(value < limit ? 'below' : 'above');
    // Only the out-of-range reading is marked, in its own cell.
    const marks = [...(row?.querySelectorAll('.beyond') ?? [])];
    const cell = row?.querySelector(`[data-sensor="${sensor}"]`);
    if (!state.readings[sensor]) continue;
    const mark = marks.find((each) => cell?.contains(each));
    expect(mark?.textContent).toMatch(value < limit ? /^low / : /^high /);
    // Arrows are reserved for trends.
    expect(cell?.querySelector('svg')).toBeNull();
  }
  const ranged = reported.filter(({ kind, sensor }) => kind === 'range' && state.readings[sensor]);
  expect(row?.querySelectorAll('.beyond')).toHaveLength(ranged.length);
  flush(() => {
    act(withTag(null));
  });
});
