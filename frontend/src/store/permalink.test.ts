import { describe, expect, test } from 'vitest';

import { fromFragment, toFragment, type Linked } from './permalink';
import { DEFAULT_LAYERS, DEFAULT_VIEW } from './view';

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
  ])('%s is passed over', (fragment) => {
    expect(fromFragment(fragment)).toEqual({
      sensor: DEFAULT_VIEW.sensor,
      selected: null,
      camera: null,
      ranges: new Map(),
      layers: DEFAULT_LAYERS,
    });
  });

  test('an unknown layer is passed over', () => {
    expect([...fromFragment('layers=pins,lasers').layers]).toEqual(['pins']);
  });
});
