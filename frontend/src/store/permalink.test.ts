import { describe, expect, test } from 'vitest';

import { fromFragment, toFragment, type Linked } from './permalink';
import { DEFAULT_LAYERS, DEFAULT_VIEW, LONGEST_FILTER } from './view';

describe('permalink', () => {
  test('a plain view needs no fragment', () => {
    expect(toFragment(DEFAULT_VIEW)).toBe('');
    expect(fromFragment('')).toMatchObject({ sensor: DEFAULT_VIEW.sensor, camera: null });
  });

  test('everything survives the way there and back', () => {
    const view: Linked = {
      sensor: 'soil_moisture',
      selected: 'tag 7/ä&#',
      camera: { x: -1.25, y: 4.5, span: 6.75 },
      ranges: new Map([
        ['soil_moisture', { low: -3, high: 12.5 }],
        ['a,b=&c', { low: 400, high: 1200 }],
      ]),
      layers: new Set(['map', 'field', 'smooth', 'pins']),
      sort: { column: 'soil_moisture', descending: true },
      filter: 'basil & "pest"',
      health: 'no-data',
    };
    expect(fromFragment(`#${toFragment(view)}`)).toEqual(view);
  });

  test('the range of the sensor in view has the short name', () => {
    const ranges = new Map([['co2', { low: 1, high: 2 }]]);
    expect(toFragment({ ...DEFAULT_VIEW, sensor: 'co2', ranges })).toBe('sensor=co2&range=1,2');
    expect(toFragment({ ...DEFAULT_VIEW, ranges })).toBe('range.co2=1,2');
  });

  test('no layer at all is a choice too', () => {
    const view = { ...DEFAULT_VIEW, layers: new Set<never>() };
    expect(fromFragment(toFragment(view)).layers.size).toBe(0);
  });

  test.each([
    'view=1,2',
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
  ])('%s is passed over', (fragment) => {
    expect(fromFragment(fragment)).toEqual({
      sensor: DEFAULT_VIEW.sensor,
      selected: null,
      camera: null,
      ranges: new Map(),
      layers: DEFAULT_LAYERS,
      sort: DEFAULT_VIEW.sort,
      filter: '',
      health: null,
    });
  });

  test('what is as by default is left out of the table’s part too', () => {
    const sort = { column: 'age', descending: false };
    expect(toFragment({ ...DEFAULT_VIEW, sort, filter: 'a b', health: 'critical' })).toBe(
      'sort=age&filter=a+b&health=critical',
    );
    const tag = { column: 'tag', descending: true };
    expect(toFragment({ ...DEFAULT_VIEW, sort: tag })).toBe('sort=-tag');
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
