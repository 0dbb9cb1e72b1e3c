import { render } from '@testing-library/react';
import type { JSX } from 'react';
import { expect, test } from 'vitest';

import type { Timeline } from '../domain/timeline';
import { timelineWith } from '../testing/timeline';
import { type Axis, columnsOf } from './axis';
import { Bar } from './Bar';

const AXIS: Axis = { from: 100, to: 200, width: 1_000 };
const NOTHING = { scans: 0, failures: 0, looks: 0, pests_seen: 0, pests_cleared: 0 };

const drawn = (over: Partial<Timeline>): Element => {
  const timeline = timelineWith(over);
  return render(<Bar axis={AXIS} timeline={timeline} columns={columnsOf(timeline, AXIS)} />)
    .container;
};

const marks = (bar: Element): (string | null)[] =>
  [...bar.querySelectorAll('[data-mark]')].map((each) => each.getAttribute('data-mark'));
const boxesOf = (bar: Element, mark: string): number[][] =>
  [...bar.querySelectorAll(`[data-mark='${mark}']`)].map((each) =>
    ['x', 'y', 'width', 'height'].map((name) => Number(each.getAttribute(name))),
  );

test('scans stand upwards and failures hang downwards, from one line', () => {
  const bar = drawn({ buckets: [{ ...NOTHING, start: 150, scans: 9, failures: 4 }] });
  const [[, top = 0, , height = 0] = []] = boxesOf(bar, 'scans');
  expect(top + height).toBe(38);
  expect(boxesOf(bar, 'failures')[0]?.[1]).toBe(39);
});

test('failures side by side are one low mark', () => {
  const failed = { ...NOTHING, scans: 9, failures: 1 };
  const bar = drawn({
    buckets: [
      { ...failed, start: 150 },
      { ...failed, start: 151 },
    ],
  });
  const [[x = 0, , width = 0, height] = [], [next] = []] = boxesOf(bar, 'failures');
  expect(x + width).toBe(next);
  expect(height).toBe(3);
});

test('a pest is no ring, one that is gone is; who needs somebody is on top', () => {
  const both = { ...NOTHING, start: 150, pests_seen: 1, pests_cleared: 1 };
  const seen = drawn({ buckets: [both] });
  expect(marks(seen)).toEqual(['pest']);
  expect(seen.querySelector('circle')).toBeNull();
  const cleared = drawn({ buckets: [{ ...both, pests_seen: 0 }] });
  expect(marks(cleared)).toEqual(['cleared']);
  expect(cleared.querySelector('circle')).not.toBeNull();
  // Too close to fit, before it or after it.
  const close = [
    { ...NOTHING, start: 149.4, pests_cleared: 1 },
    { ...NOTHING, start: 150, pests_seen: 1 },
    { ...NOTHING, start: 150.5, pests_seen: 1 },
    { ...NOTHING, start: 152, pests_cleared: 1 },
  ];
  expect(marks(drawn({ bucket_s: 0.1, buckets: close }))).toEqual(['pest', 'cleared']);
});

test('silences and missing data are hatched, each in its own way', () => {
  const bar = drawn({
    silences: [{ from: 120, to: 130 }],
    reach: { from: 110, to: 200 },
    missing: [{ from: 190, to: 200, why: 'not_recorded' }],
  });
  expect(boxesOf(bar, 'unknown')).toEqual([
    [0, 14, 100, 32],
    [900, 14, 100, 32],
  ]);
  expect(boxesOf(bar, 'silence')).toEqual([[200, 14, 100, 32]]);
  const lines = ['unknown', 'silence'].map((mark) => {
    const fill = bar.querySelector(`[data-mark='${mark}']`)?.getAttribute('fill') ?? '';
    return bar.querySelector(`${fill.slice(4, -1)} path`)?.getAttribute('d');
  });
  expect(new Set([...lines, undefined]).size).toBe(3);
});

test('a clock that began anew is a line of its own', () => {
  const runs = [
    { from: 100, to: 150 },
    { from: 150, to: 200 },
  ].map((run) => ({ ...run, is_simulated: false }));
  expect(marks(drawn({ runs }))).toEqual(['run']);
  expect(marks(drawn({}))).toEqual([]);
  // No stale marks after a first render without width.
  const timeline = timelineWith({ runs: [...runs, { from: 180, to: 200, is_simulated: false }] });
  const bar = (width: number): JSX.Element => (
    <Bar axis={{ ...AXIS, width }} timeline={timeline} columns={[]} />
  );
  const { container, rerender } = render(bar(0));
  rerender(bar(1_000));
  expect(marks(container)).toEqual(['run', 'run']);
});

test('times stand beside their dates, and never upon each other, however large the text is', () => {
  document.documentElement.style.fontSize = '32px';
  const axis = { from: 1.8e9, to: 1.8e9 + 3_600, width: 400 };
  const { container, rerender } = render(<Bar axis={axis} timeline={null} columns={[]} />);
  document.documentElement.style.fontSize = '';
  const texts = [...container.querySelectorAll('text')];
  expect(texts[0]?.textContent).toMatch(/^\d+ \w+ \d\d:\d\d$/);
  expect(texts.length).toBeGreaterThan(1);
  const ends = texts.map((each) => Number(each.getAttribute('x')) + each.textContent.length * 12.8);
  texts.slice(1).forEach((each, index) => {
    expect(Number(each.getAttribute('x'))).toBeGreaterThan(ends[index] ?? Infinity);
  });
  rerender(<Bar axis={{ ...axis, to: axis.from + 604_800 }} timeline={null} columns={[]} />);
  expect(container.querySelector('text')?.textContent).toMatch(/^\d+ \w+ \d{4}$/);
});
