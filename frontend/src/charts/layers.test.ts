import { expect, test, vi } from 'vitest';

import { seriesWith } from '../testing/timeline';
import { MOST_CHARTED } from '../store/view';
import { common, drawBelow, drawMarks, type Frame, lookOf, markerPath, without } from './layers';
import type { Line } from './model';

const all = Array.from({ length: MOST_CHARTED }, (_, index) => lookOf(index));

test('each line of a chart has a colour, a dash and a marker that no other has', () => {
  expect(new Set(all.map(({ colour }) => colour)).size).toBe(MOST_CHARTED);
  expect(new Set(all.map(({ dash }) => dash.join())).size).toBe(MOST_CHARTED);
  expect(new Set(all.map(({ marker }) => marker)).size).toBe(MOST_CHARTED);
});

test('a marker is a path around its point', () => {
  for (const { marker } of all) expect(markerPath(marker, 10, 20, 6)).toMatch(/^M[-\d. LMaZ]+$/);
  expect(markerPath('square', 10, 20, 10)).toBe('M5.5 15.5L14.5 15.5L14.5 24.5L5.5 24.5Z');
});

test('marks of inspections are dots, smaller than the crosses of failures', () => {
  vi.stubGlobal('Path2D', String);
  const [fill, stroke] = [vi.fn(), vi.fn()];
  const box = { left: 0, top: 0, width: 100, height: 50 };
  const frame = { context: { fill, stroke }, ratio: 1, box, x: Number, colour: String };
  const marks = (['inspection', 'failure'] as const).map((kind) => ({
    ...{ kind, at: 30, widthS: 0, count: 1 },
  }));
  drawMarks(frame as unknown as Frame, { marks } as unknown as Line);
  expect(String(fill.mock.calls[0])).toBe(markerPath('circle', 30, 58, 3));
  expect(String(stroke.mock.calls[0])).toBe(markerPath('cross', 30, 70, 6));
});

test('several lines have the gaps that all of them have, and only those are hatched', () => {
  const gaps = [
    { from: 0, to: 10 },
    { from: 20, to: 30 },
  ];
  const others = [{ from: 5, to: 25 }];
  expect(common([gaps])).toEqual(gaps);
  expect(common([gaps, others, [{ from: 0, to: 22 }]])).toEqual([
    { from: 5, to: 10 },
    { from: 20, to: 22 },
  ]);
  const names = ['save', 'restore', 'beginPath', 'rect', 'clip', 'moveTo', 'lineTo', 'stroke'];
  const context = Object.fromEntries(names.map((name) => [name, vi.fn()]));
  const lines = [gaps, others].map((each) => ({ series: seriesWith({ gaps: each }) }));
  const box = { left: 0, top: 0, width: 100, height: 50 };
  const model = { lines, bands: [] };
  drawBelow({ context, ratio: 1, box, x: Number, colour: String, model } as unknown as Frame);
  expect(context['rect']?.mock.calls.slice(1)).toEqual([
    [5, 0, 5, 50],
    [20, 0, 5, 50],
  ]);
});

test('a gap is hatched once: where the journal is incomplete, only as that', () => {
  const gaps = [
    { from: 0, to: 10 },
    { from: 20, to: 30 },
  ];
  const missing = [
    { from: -5, to: 3 },
    { from: 22, to: 24 },
  ];
  expect(without(gaps, missing)).toEqual([
    { from: 3, to: 10 },
    { from: 20, to: 22 },
    { from: 24, to: 30 },
  ]);
});
