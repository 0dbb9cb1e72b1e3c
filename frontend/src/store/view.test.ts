import { expect, test } from 'vitest';

import { fromFragment, toFragment } from './address';
import { DEFAULT_VIEW, fixedRange, reduceView, type ViewState } from './view';

test('each sensor keeps its own fixed range', () => {
  const range = { low: 1, high: 2 };
  const fixed = reduceView(DEFAULT_VIEW, { type: 'range', range });
  const other = reduceView(fixed, { type: 'sensor', sensor: 'co2' });
  expect(fixedRange(other)).toBeNull();
  const both = reduceView(other, { type: 'range', range: { low: 400, high: 900 } });
  const back = reduceView(both, { type: 'sensor', sensor: DEFAULT_VIEW.sensor });
  expect(fixedRange(back)).toEqual(range);
  const free = reduceView(back, { type: 'range', range: null });
  expect([...free.ranges.keys()]).toEqual(['co2']);
  expect(DEFAULT_VIEW.ranges.size).toBe(0);
});

test('the sensor that is in view already changes nothing', () => {
  const same = { type: 'sensor', sensor: DEFAULT_VIEW.sensor } as const;
  expect(reduceView(DEFAULT_VIEW, same)).toBe(DEFAULT_VIEW);
});

test('a column sorts upwards first, then downwards, then upwards', () => {
  const once = reduceView(DEFAULT_VIEW, { type: 'sort', column: 'age' });
  const twice = reduceView(once, { type: 'sort', column: 'age' });
  const thrice = reduceView(twice, { type: 'sort', column: 'age' });
  expect([once, twice, thrice].map(({ sort }) => sort.descending)).toEqual([false, true, false]);
});

test('layers go on and off without touching the old set', () => {
  const off = reduceView(DEFAULT_VIEW, { type: 'layer', layer: 'pins', on: false });
  expect(off.layers.has('pins')).toBe(false);
  expect(DEFAULT_VIEW.layers.has('pins')).toBe(true);
  expect(reduceView(off, { type: 'layer', layer: 'pins', on: true }).layers.has('pins')).toBe(true);
});

test('smooth is on demand, everything else is on', () => {
  expect(DEFAULT_VIEW.layers.has('smooth')).toBe(false);
  expect(DEFAULT_VIEW.layers.has('field')).toBe(true);
});

test('a moment is held to the millisecond, and the same one changes nothing', () => {
  const back = reduceView(DEFAULT_VIEW, { type: 'moment', moment: 12.34567 });
  expect(back.moment).toBe(12.346);
  expect(reduceView(back, { type: 'moment', moment: 12.3461 })).toBe(back);
  expect(reduceView(back, { type: 'moment', moment: -5 }).moment).toBe(0);
  expect(reduceView(back, { type: 'moment', moment: null }).moment).toBeNull();
});

test('charts of a tag follow the tag that is chosen, those of a sensor keep theirs', () => {
  const one = reduceView(DEFAULT_VIEW, { type: 'chart', chart: { by: 'tag', tagIds: ['5'] } });
  expect(reduceView(one, { type: 'select', tagId: '7' }).chart?.tagIds).toEqual(['7']);
  expect(reduceView(one, { type: 'select', tagId: null }).chart?.tagIds).toEqual(['5']);
  const some = { by: 'sensor', tagIds: ['5', '6'] } as const;
  const several = reduceView(DEFAULT_VIEW, { type: 'chart', chart: some });
  expect(reduceView(several, { type: 'select', tagId: '7' }).chart).toEqual(some);
  expect(reduceView(several, { type: 'chart', chart: { by: 'tag', tagIds: [] } }).chart).toBeNull();
});

test('charts stand where the map is, and lead back to where they were opened', () => {
  const chart = { type: 'chart', chart: { by: 'tag', tagIds: ['5'] } } as const;
  const close = { type: 'chart', chart: null } as const;
  const list = reduceView(DEFAULT_VIEW, { type: 'list', list: 'tags' });
  const open = reduceView(list, chart);
  expect(open.pane).toBe('map');
  expect(reduceView(reduceView(open, chart), close).pane).toBe('tags');
  expect(reduceView(reduceView(DEFAULT_VIEW, chart), close).pane).toBe('map');
  // Who went on to the map by hand stays there.
  expect(reduceView(reduceView(open, { type: 'pane', pane: 'map' }), close).pane).toBe('map');
  // So does who went on to a list.
  const alarms = reduceView(reduceView(DEFAULT_VIEW, chart), { type: 'list', list: 'alarms' });
  expect(reduceView(alarms, close).pane).toBe('tags');
});

test('the list beside the map: a narrow screen shows it, and a filter of the table the table', () => {
  const alarms = reduceView(DEFAULT_VIEW, { type: 'list', list: 'alarms' });
  expect(alarms).toMatchObject({ list: 'alarms', pane: 'tags' });
  expect(reduceView(alarms, { type: 'health', verdict: 'critical' }).list).toBe('tags');
  const map = reduceView(alarms, { type: 'pane', pane: 'map' });
  expect(map.list).toBe('alarms');
  // A link shows what was in sight when it was made.
  const follow = (from: ViewState): ViewState =>
    reduceView(DEFAULT_VIEW, { type: 'look', view: fromFragment(toFragment(from)) });
  expect(follow(alarms)).toMatchObject({ list: 'alarms', pane: 'tags' });
  expect(follow(map)).toMatchObject({ list: 'tags', pane: 'map' });
});
