import { describe, expect, test } from 'vitest';

import { judgement, NOBODY, reason } from '../testing/health';
import { readings, tag } from '../testing/tags';
import { houseHealth } from './health';
import { filterRows, rowsOf, sortRows, tableCsv, type Row } from './table';
import { compareIds } from './twin';
import { CATALOGUE, IN_FAHRENHEIT, sensorNamed } from '../testing/sensors';

const tags = [
  tag({
    tag_id: '2',
    readings: readings({ temperature: 20 }),
    species: 'rose',
    last_observed: 100.25,
  }),
  tag({ tag_id: '10', readings: readings({ temperature: 35 }), anomaly: true, bug_count: 3 }),
  tag({
    tag_id: '9',
    // A later flower inspection makes no reading younger.
    stale_seconds: 1,
    readings: readings({ humidity: 60 }, 25),
  }),
  tag({
    tag_id: '1',
    stale_seconds: null,
    last_observed: 0,
    pose: { position: { x: 0, y: 0, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 0 } },
  }),
];
const said = judgement({
  1: 'unknown',
  2: 'healthy',
  9: 'healthy',
  10: [
    reason({ value: 35, limit: 30 }),
    reason({ kind: 'pest', sensor: '', value: 3, limit: null }),
  ],
});
const rows = rowsOf(tags, houseHealth(tags, said, true));
/** As `sortRows` wants them. */
const byId = [...rows].sort((a, b) => compareIds(a.tag.id, b.tag.id));
const ids = (list: readonly Row[]): string[] => list.map((row) => row.tag.id);

describe('sorting', () => {
  test('ids by number', () => {
    expect(ids(sortRows(byId, { column: 'tag', descending: false }))).toEqual([
      '1',
      '2',
      '9',
      '10',
    ]);
  });

  test('what has no value is last in both directions', () => {
    const up = ids(sortRows(byId, { column: 'temperature', descending: false }));
    const down = ids(sortRows(byId, { column: 'temperature', descending: true }));
    expect(up).toEqual(['2', '10', '1', '9']);
    expect(down).toEqual(['10', '2', '1', '9']);
  });

  test.each([
    ['health', '10'],
    ['age', '9'],
    ['species', '2'],
  ])('by %s, highest first', (column, first) => {
    expect(ids(sortRows(byId, { column, descending: true }))[0]).toBe(first);
  });

  test('equals stay in the order of their ids, whatever the direction', () => {
    for (const descending of [false, true]) {
      expect(ids(sortRows(byId, { column: 'flowers', descending }))).toEqual(['2', '9', '10', '1']);
    }
    expect(ids(sortRows(byId, { column: 'tag', descending: true }))).toEqual(['10', '9', '2', '1']);
  });

  test('texts are sorted as a person would', () => {
    const named = ['b10', 'b9', 'a'].map((species, i) => tag({ tag_id: String(i), species }));
    const some = rowsOf(named, houseHealth(named, NOBODY, true));
    expect(ids(sortRows(some, { column: 'species', descending: false }))).toEqual(['2', '1', '0']);
  });
});

describe('filter', () => {
  test.each([
    ['', ['2', '10', '9', '1']],
    ['ROSE', ['2']],
    ['pest', ['10']],
    ['no pin', ['1']],
    ['humid', ['9']],
    ['critical temp', ['10']],
    ['rose pest', []],
    // Equals a tag's id, so 10 does not match.
    ['1', ['1']],
  ])('%j', (text, expected) => {
    expect(ids(filterRows(rows, text, null, CATALOGUE))).toEqual(expected);
  });

  test('by health', () => {
    expect(ids(filterRows(rows, '', 'unknown', CATALOGUE))).toEqual(['1']);
  });
});

test('the file has every tag, values in the shown unit, and ages of its time', () => {
  const sensors = [sensorNamed('temperature', 'F'), sensorNamed('humidity')];
  const text = tableCsv(rows, IN_FAHRENHEIT, sensors, 115);
  const lines = text.split('\r\n');
  expect(lines[0]).toContain('Temperature [°F],Humidity [%]');
  expect(lines).toHaveLength(1 + tags.length + 1);
  expect(lines[1]).toBe('2,healthy,,68,,rose,,0,0,no,15,1970-01-01T00:01:40.250Z,1,2');
  expect(lines[2]).toBe(
    '10,critical,"Temperature 95.0\u00a0°F, above 86.0 (critical); 3 pests seen",95,,,,0,3,yes,15,1970-01-01T00:01:40.000Z,1,2',
  );
  expect(lines[4]).toBe('1,unknown,,,,,,0,0,no,,,,');
});
