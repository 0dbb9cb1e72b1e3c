import { render } from '@testing-library/react';
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

test('of a pest and one that is gone, who needs somebody is on top', () => {
  const both = { ...NOTHING, start: 150, pests_seen: 1, pests_cleared: 1 };
  expect(marks(drawn({ buckets: [both] }))).toEqual(['pest']);
  expect(marks(drawn({ buckets: [{ ...both, pests_seen: 0 }] }))).toEqual(['cleared']);
  // Beside it without room, before it or behind.
  const close = [
    { ...NOTHING, start: 149.4, pests_cleared: 1 },
    { ...NOTHING, start: 150, pests_seen: 1 },
    { ...NOTHING, start: 150.5, pests_seen: 1 },
    { ...NOTHING, start: 152, pests_cleared: 1 },
  ];
  expect(marks(drawn({ bucketS: 0.1, buckets: close }))).toEqual(['pest', 'cleared']);
});

test('silence and what is not remembered are hatched, each in its own way', () => {
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
  const lines = [...bar.querySelectorAll('pattern path')].map((each) => each.getAttribute('d'));
  expect(new Set(lines).size).toBe(2);
});

test('a clock that began anew is a line of its own', () => {
  const runs = [
    { from: 100, to: 150 },
    { from: 150, to: 200 },
  ];
  expect(marks(drawn({ runs }))).toEqual(['run']);
  expect(marks(drawn({}))).toEqual([]);
});

test('times stand never upon each other', () => {
  const axis = { from: 1.8e9, to: 1.8e9 + 3_600, width: 300 };
  const { container } = render(<Bar axis={axis} timeline={null} columns={[]} />);
  const texts = [...container.querySelectorAll('text')];
  expect(texts.length).toBeGreaterThan(1);
  const ends = texts.map((each) => Number(each.getAttribute('x')) + each.textContent.length * 6.4);
  texts.slice(1).forEach((each, index) => {
    expect(Number(each.getAttribute('x'))).toBeGreaterThan(ends[index] ?? Infinity);
  });
});
