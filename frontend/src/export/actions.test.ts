import { beforeEach, describe, expect, test, vi } from 'vitest';

import { snapshotOf } from '../domain/twin';
import { act, prefer, receive } from '../store/app';
import { withSort } from '../store/view';
import { NO_HOUSE, withPast } from '../store/twin';
import { FakeContext } from '../testing/canvas';
import { estimated } from '../testing/field';
import { nextStamp, showField, showTags } from '../testing/page';
import { readings, stateFrame, wireTag } from '../testing/tags';
import { FOOTER_PX, saveMap, saveTable } from './actions';
import { fileName } from './save';

// A half-hour offset, set before any module reads the clock.
vi.hoisted(() => {
  vi.stubEnv('TZ', 'Asia/Kolkata');
});

let saved: Blob[];
let names: string[];

beforeEach(() => {
  saved = [];
  names = [];
  URL.createObjectURL = (blob: Blob) => {
    saved.push(blob);
    return 'blob:test';
  };
  vi.spyOn(HTMLAnchorElement.prototype, 'click').mockImplementation(function (
    this: HTMLAnchorElement,
  ) {
    names.push(this.download);
  });
  showTags([
    wireTag({ tag_id: '10', readings: readings({ temperature: 20 }) }),
    wireTag({
      tag_id: '=9',
      readings: readings({ temperature: 30 }, nextStamp() - 5),
      species: 'rose',
    }),
  ]);
});

describe('table as a file', () => {
  const lines = async (): Promise<string[]> => (await saved[0]?.text())?.split('\r\n') ?? [];

  test('is what the operator sees: filter, order and unit', async () => {
    act({ filter: 'rose' });
    prefer({ unit: 'F' });
    saveTable();
    const [head, first, ...rest] = await lines();
    expect(head).toContain('Temperature [°F]');
    expect(first).toMatch(/^'=9,.*,86,/);
    expect(rest).toEqual(['']);
    expect(names[0]).toMatch(/^lupin-twin-tags-.*\.csv$/);
  });

  test('ages are those of the moment in the file’s name, however much later it is saved', async () => {
    const now = performance.now();
    vi.spyOn(performance, 'now').mockReturnValue(now + 3_600_000);
    saveTable();
    // 5 s old when the state was taken.
    expect((await lines())[1]).toMatch(/,5,1970-01-01T00:01:40\.000Z,/);
  });

  test('is sorted as the table is', async () => {
    act(withSort('temperature'));
    act(withSort('temperature'));
    saveTable();
    expect((await lines())[1]).toMatch(/^'=9/);
  });
});

test('a picture is taken of the layers, and says what their colours show', async () => {
  const layer = document.createElement('canvas');
  layer.dataset['layer'] = 'still';
  // A hidden map's canvas: drawn at twice the resolution, but without a layout size.
  layer.width = layer.height = 20;
  layer.style.width = '10px';
  document.body.append(layer);
  let result: HTMLCanvasElement | null = null;
  vi.spyOn(HTMLCanvasElement.prototype, 'toBlob').mockImplementation(function (
    this: HTMLCanvasElement,
    callback: BlobCallback,
  ) {
    // eslint-disable-next-line @typescript-eslint/no-this-alias -- which one it was
    result = this;
    callback(new Blob(['png']));
  });
  const height = (): number => result?.height ?? 0;
  const calls = (name: string) => (result && FakeContext.recordOf(result)?.named(name)) ?? [];
  const drawn = (): number => calls('drawImage').length;
  await saveMap();
  expect(drawn()).toBe(1);
  expect(height()).toBe(20 + 2 * FOOTER_PX);
  expect(names).toHaveLength(1);
  // The footer has the legend of what the map shows.
  act({ heat: 'error' });
  // An error that would be rounded to zero is not.
  showField(estimated([22], [0.01]));
  await saveMap();
  layer.remove();
  const texts = calls('fillText').map(({ args }) => args[0]);
  expect(texts[0]).toBe('Temperature: Uncertainty ±\u00a00\u00a0to\u00a00.016\u00a0°C');
});

describe('of another moment', () => {
  test.each([
    [Date.UTC(2026, 4, 1, 8, 33, 22) / 1000, 'lupin-twin-tags-past-2026-05-01T14-03-22.csv'],
    [5_025, 'lupin-twin-tags-past-sim-01-23-45.csv'],
  ])('the file’s name says the moment, and that it is past: %i', async (at, name) => {
    const then = wireTag({ tag_id: 'then', readings: readings({ temperature: 12 }, at - 5) });
    const snapshot = snapshotOf(stateFrame([then], { sec: at }), at * 1000, null);
    receive(withPast({ at, house: { ...NO_HOUSE, snapshot } }));
    act({ moment: at });
    saveTable();
    expect(names).toEqual([name]);
    expect((await saved[0]?.text())?.split('\r\n')[1]).toMatch(/^then,.*,5,/);
  });
});

test('a file’s name sorts by time and is legal everywhere', () => {
  // In the browser's time zone, like the time in the picture.
  expect(fileName('map', 'png', Date.UTC(2026, 4, 1, 8, 33, 22))).toBe(
    'lupin-twin-map-2026-05-01T14-03-22.png',
  );
  // A simulation has no dates.
  expect(fileName('chart', 'csv', 5_025_000)).toBe('lupin-twin-chart-sim-01-23-45.csv');
});
