import { expect, test } from 'vitest';

import { fromFragment, toFragment } from './address';
import {
  DEFAULT_VIEW,
  viewAfter,
  type ViewState,
  withChart,
  withList,
  withSort,
  withTag,
} from './view';

test('the sensor that is in view already changes nothing', () => {
  const same = { sensor: DEFAULT_VIEW.sensor };
  expect(viewAfter(DEFAULT_VIEW, same)).toBe(DEFAULT_VIEW);
});

test('a column sorts upwards first, then downwards, then upwards', () => {
  const once = viewAfter(DEFAULT_VIEW, withSort('age'));
  const twice = viewAfter(once, withSort('age'));
  const thrice = viewAfter(twice, withSort('age'));
  expect([once, twice, thrice].map(({ sort }) => sort.descending)).toEqual([false, true, false]);
});

test('suggested positions are on demand, all other layers are on', () => {
  expect(DEFAULT_VIEW.layers.has('advice')).toBe(false);
  expect(DEFAULT_VIEW.layers.has('field')).toBe(true);
});

test('a moment is held to the millisecond, and the same one changes nothing', () => {
  const back = viewAfter(DEFAULT_VIEW, { moment: 12.34567 });
  expect(back.moment).toBe(12.346);
  expect(viewAfter(back, { moment: 12.3461 })).toBe(back);
  expect(viewAfter(back, { moment: -5 }).moment).toBe(0);
  expect(viewAfter(back, { moment: null }).moment).toBeNull();
});

test('charts of a tag follow the tag that is chosen, those of a sensor keep theirs', () => {
  const one = viewAfter(DEFAULT_VIEW, withChart({ by: 'tag', tagIds: ['5'] }));
  expect(viewAfter(one, withTag('7')).chart?.tagIds).toEqual(['7']);
  expect(viewAfter(one, withTag(null)).chart?.tagIds).toEqual(['5']);
  const some = { by: 'sensor', tagIds: ['5', '6'] } as const;
  const several = viewAfter(DEFAULT_VIEW, withChart(some));
  expect(viewAfter(several, withTag('7')).chart).toEqual(some);
  expect(viewAfter(several, withChart({ by: 'tag', tagIds: [] })).chart).toBeNull();
});

test('charts stand where the map is, and lead back to where they were opened', () => {
  const chart = withChart({ by: 'tag', tagIds: ['5'] });
  const close = withChart(null);
  const list = viewAfter(DEFAULT_VIEW, withList('tags'));
  const open = viewAfter(list, chart);
  expect(open.pane).toBe('map');
  expect(viewAfter(viewAfter(open, chart), close).pane).toBe('tags');
  expect(viewAfter(viewAfter(DEFAULT_VIEW, chart), close).pane).toBe('map');
  // After a switch to the map by hand, the map stays.
  expect(viewAfter(viewAfter(open, { pane: 'map', chartedFrom: null }), close).pane).toBe('map');
  // So does a list.
  const alarms = viewAfter(viewAfter(DEFAULT_VIEW, chart), withList('alarms'));
  expect(viewAfter(alarms, close).pane).toBe('tags');
});

test('the list beside the map: a narrow screen shows it, and a filter of the table the table', () => {
  const alarms = viewAfter(DEFAULT_VIEW, withList('alarms'));
  expect(alarms).toMatchObject({ list: 'alarms', pane: 'tags' });
  expect(viewAfter(alarms, { health: 'critical', list: 'tags' }).list).toBe('tags');
  const map = viewAfter(alarms, { pane: 'map', chartedFrom: null });
  expect(map.list).toBe('alarms');
  // A link shows what was visible when it was made.
  const follow = (from: ViewState): ViewState =>
    viewAfter(DEFAULT_VIEW, fromFragment(toFragment(from)));
  expect(follow(alarms)).toMatchObject({ list: 'alarms', pane: 'tags' });
  expect(follow(map)).toMatchObject({ list: 'tags', pane: 'map' });
});
