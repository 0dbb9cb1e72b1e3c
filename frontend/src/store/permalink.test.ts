import { describe, expect, test } from 'vitest';

import { fromFragment, toFragment, type Linked } from './address';
import { DEFAULT_LAYERS, DEFAULT_VIEW, LONGEST_FILTER } from './view';

describe('permalink', () => {
  test('a plain view needs no fragment', () => {
    expect(toFragment(DEFAULT_VIEW)).toBe('');
    expect(fromFragment('')).toMatchObject({ sensor: DEFAULT_VIEW.sensor, camera: null });
  });

  test('everything survives the way there and back', () => {
    const view: Linked = {
      moment: 1_794_000_000.125,
      period: { kind: 'own', from: 1_793_000_000, to: 1_794_100_000.5 },
      compare: { by: 'ago', seconds: 86_400 },
      chart: { by: 'sensor', tagIds: ['a,b', '2'] },
      sensor: 'soil_moisture',
      selected: 'tag 7/ä&#',
      camera: { x: -1.25, y: 4.5, span: 6.75 },
      heat: 'error',
      colouring: 'value',
      ranges: new Map([
        ['soil_moisture', { low: -3, high: 12.5 }],
        ['a,b=&c', { low: 400, high: 1200 }],
      ]),
      layers: new Set(['map', 'field', 'smooth', 'pins']),
      sort: { column: 'soil_moisture', descending: true },
      filter: 'basil & "pest"',
      health: 'unknown',
      list: 'alarms',
    };
    expect(fromFragment(`#${toFragment({ ...view, pane: 'tags' })}`)).toEqual(view);
  });

  test('the range of the sensor in view has the short name', () => {
    const ranges = new Map([['co2', { low: 1, high: 2 }]]);
    expect(toFragment({ ...DEFAULT_VIEW, sensor: 'co2', ranges })).toBe('sensor=co2&range=1,2');
    expect(toFragment({ ...DEFAULT_VIEW, ranges })).toBe('range.co2=1,2');
  });

  test.each([
    ['period=week', { kind: 'week' }],
    ['period=all', { kind: 'all' }],
    ['period=100,250.5', { kind: 'own', from: 100, to: 250.5 }],
  ] as const)('%s is a period', (fragment, period) => {
    expect(fromFragment(fragment).period).toEqual(period);
    expect(toFragment({ ...DEFAULT_VIEW, period })).toBe(fragment);
  });

  test.each([
    ['compare=-604800', { compare: { by: 'ago', seconds: 604_800 } }],
    ['compare=1794000000.5', { compare: { by: 'moment', at: 1_794_000_000.5 } }],
    ['heat=estimate', { heat: 'estimate' }],
    ['chart.tag=5', { chart: { by: 'tag', tagIds: ['5'] } }],
    ['chart.sensor=5&chart.sensor=7', { chart: { by: 'sensor', tagIds: ['5', '7'] } }],
  ] as const)('%s is held', (fragment, part) => {
    expect(fromFragment(fragment)).toMatchObject(part);
    expect(toFragment({ ...DEFAULT_VIEW, ...part })).toBe(fragment);
  });

  test('a chart has eight tags at most, and none twice', () => {
    const ids = (many: number): string =>
      Array.from({ length: many }, (_, index) => `chart.sensor=${index}`).join('&');
    expect(fromFragment(ids(8)).chart?.tagIds).toHaveLength(8);
    expect(fromFragment(ids(9)).chart?.tagIds).toHaveLength(8);
    expect(fromFragment('chart.sensor=1&chart.sensor=1').chart?.tagIds).toEqual(['1']);
  });

  test('a moment is held to the millisecond', () => {
    expect(toFragment({ ...DEFAULT_VIEW, moment: 1_794_000_000.125 })).toBe('at=1794000000.125');
    expect(fromFragment('at=1794000000.1254').moment).toBe(1_794_000_000.125);
    expect(fromFragment('at=0').moment).toBe(0);
  });

  test('no layer at all is a choice too', () => {
    const view = { ...DEFAULT_VIEW, layers: new Set<never>() };
    expect(fromFragment(toFragment(view)).layers.size).toBe(0);
  });

  test.each([
    'compare=',
    'compare=yesterday',
    'compare=-0',
    'chart.tag=',
    'chart=5',
    'at=',
    'at=-1',
    'at=yesterday',
    'at=1e999',
    'period=fortnight',
    'period=5,5',
    'period=9,1',
    'period=-1,1',
    'view=1,2',
    'view=1e30,2,3',
    'view=1,-1e308,3',
    'view=1,2,0',
    'view=1,2,-4',
    'view=a,b,c',
    'view=,,',
    'range=5,5',
    'range=9,1',
    'range=1,Infinity',
    'range.co2=9,1',
    'range.=1,9',
    'sensor=&tag=',
    'nonsense',
    'sort=-',
    'sort=',
    'health=ill',
    'health=',
    'filter=',
    'colour=',
    'colour=rainbow',
    'heat=',
    'heat=idw',
    'list=tags',
    'list=notes',
  ])('%s is passed over', (fragment) => {
    expect(fromFragment(fragment)).toEqual({
      moment: null,
      period: { kind: 'day' },
      compare: null,
      chart: null,
      sensor: DEFAULT_VIEW.sensor,
      selected: null,
      camera: null,
      heat: 'nearest',
      colouring: 'ideal',
      ranges: new Map(),
      layers: DEFAULT_LAYERS,
      sort: DEFAULT_VIEW.sort,
      filter: '',
      health: null,
      list: 'tags',
    });
  });

  test('what is as by default is left out of the table’s part too', () => {
    const sort = { column: 'age', descending: false };
    expect(toFragment({ ...DEFAULT_VIEW, sort, filter: 'a b', health: 'critical' })).toBe(
      'sort=age&filter=a+b&health=critical',
    );
    const tag = { column: 'tag', descending: true };
    expect(toFragment({ ...DEFAULT_VIEW, sort: tag })).toBe('sort=-tag');
    const upwards = { column: 'tag', descending: false };
    expect(toFragment({ ...DEFAULT_VIEW, sort: upwards })).toBe('sort=tag');
    expect(fromFragment('sort=tag').sort).toEqual(upwards);
  });

  test('a filter is as long as one can type', () => {
    const text = 'x'.repeat(LONGEST_FILTER);
    expect(fromFragment(`filter=${text}`).filter).toBe(text);
    expect(fromFragment(`filter=${text}y`).filter).toBe(text);
  });

  test('an unknown layer is passed over', () => {
    expect([...fromFragment('layers=pins,lasers').layers]).toEqual(['pins']);
  });
});
