import { beforeEach, expect, test } from 'vitest';

import { act, store } from '../store/app';
import { DEFAULT_VIEW } from '../store/view';
import { SHORTEST_S, wholePeriod, zoomBack, zoomBy, zoomedSpan, zoomTo } from './zoom';

const period = (): unknown => store.get().view.period;

beforeEach(() => {
  act(DEFAULT_VIEW);
  wholePeriod.set(null);
});

test('a part of the period becomes the period, and there is a way back to the whole', () => {
  zoomTo({ from: 1_000, to: 2_000 });
  zoomTo({ from: 1_100, to: 1_200.0004 });
  expect(period()).toEqual({ kind: 'own', from: 1_100, to: 1_200 });
  zoomBack();
  expect(period()).toEqual(DEFAULT_VIEW.period);
  zoomBack();
  expect(period()).toEqual(DEFAULT_VIEW.period);
});

test('a period that was chosen after a zoom is the whole one of the next', () => {
  zoomTo({ from: 1_000, to: 2_000 });
  act({ period: { kind: 'week' } });
  zoomTo({ from: 1_000, to: 2_000 });
  zoomBack();
  expect(period()).toEqual({ kind: 'week' });
});

test('a part is never shorter than there is something to see, nor before all time', () => {
  expect(zoomedSpan({ from: 100, to: 100 + SHORTEST_S })).toEqual({ from: 100, to: 110 });
  expect(zoomedSpan({ from: 100, to: 102 })).toEqual({ from: 96, to: 106 });
  expect(zoomedSpan({ from: 0, to: 1 })).toEqual({ from: 0, to: SHORTEST_S });
});

test('out and in again is around the middle, and never beyond now', () => {
  zoomBy({ from: 1_000, to: 2_000 }, 0.5, 9_999);
  expect(period()).toEqual({ kind: 'own', from: 1_250, to: 1_750 });
  zoomBy({ from: 1_000, to: 2_000 }, 2, 2_100);
  expect(period()).toEqual({ kind: 'own', from: 100, to: 2_100 });
});
