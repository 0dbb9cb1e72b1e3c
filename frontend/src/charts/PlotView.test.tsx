import { fireEvent, act as flush, render, screen } from '@testing-library/react';
import { beforeEach, expect, test, vi } from 'vitest';

import { readingAt, type Series } from '../domain/series';
import { act, receive, store } from '../store/app';
import { pointedTime } from '../store/create';
import { NOTHING } from '../store/fetcher';
import { showTags } from '../testing/page';
import { sensorNamed } from '../testing/sensors';
import { bucketAt, seriesWith, timelineWith } from '../testing/timeline';
import { readings, wireTag } from '../testing/tags';
import CardChart from './CardChart';
import type { Line, PlotModel } from './model';
import { axisText } from './plot';
import { LineValue, MarksKey, PlotView, SensorChoice } from './PlotView';

test.each([
  ['temperature_24h_mean', 4_680, 'Needs 24 h of readings; 1\u00a0h 18\u00a0min so far'],
  ['daily_light_integral', 90_000, 'Needs 24 h of readings without a gap longer than 3 h'],
  ['temperature', 4_680, '–'],
])('without a value %s says what it lacks', (sensor, known, expected) => {
  expect(said(sensor, known)).toBe(expected);
});

test('of a moment it counts what there was by then', () => {
  expect(said('temperature_24h_mean', 4_680, 98_920)).toMatch(/; 1\u00a0h so far$/);
});

test('with a value it says that', () => {
  const readings = [{ at: 99_000, value: 21 }];
  expect(said('temperature_24h_mean', 4_680, null, readings)).toContain('21.0\u00a0°C');
});

const plainModel = (sensor: string, lines: PlotModel['lines']): PlotModel => ({
  ...{ sensor: sensorNamed(sensor), lines, bands: [], isMixed: false },
  ...{ span: { from: 90_000, to: 100_000 }, moment: null },
});

const lineOf = (series: Series): Line => ({ series, before: null, look: 0, label: '1', marks: [] });

test.each([
  [{}, 'No reading in this period.'],
  [
    { points: [readingAt(0, 2), readingAt(40, 4), readingAt(50, null)] },
    /2 readings, the latest 4\.0.*00:00:40.* 2\.0.* 4\.0/,
  ],
  [
    { bucketS: 10, points: [bucketAt(0, 5, 3), bucketAt(10, 6, 4)], gaps: [{ from: 20, to: 30 }] },
    /7 readings, the latest 6\.0.*00:00:10.* 4\.0.* 7\.0.* 1 gap/,
  ],
])('its picture says what there is, by the least and the most, %#', (over, words) => {
  const model = plainModel('temperature', [lineOf(seriesWith(over))]);
  render(<PlotView model={model} height={100} />);
  expect(screen.getByTestId('plot').getAttribute('aria-label')).toMatch(words);
});

test('a time pointed at on the bar stays while the chart goes on', async () => {
  vi.stubGlobal('ResizeObserver', Laid);
  const model = plainModel('temperature', [lineOf(seriesWith({}))]);
  const { rerender, unmount } = render(<PlotView model={model} height={100} />);
  flush(() => pointedTime.set(95_000));
  rerender(<PlotView model={{ ...model, span: { from: 91_000, to: 101_000 } }} height={100} />);
  await flush(() => Promise.resolve());
  expect(document.querySelector('.u-over')).not.toBeNull();
  expect(pointedTime.get()).toBe(95_000);
  unmount();
});

/** Stub ResizeObserver: a chart has a size. */
class Laid {
  constructor(private readonly callback: (entries: readonly object[]) => void) {}
  observe = (): void => this.callback([{ contentRect: { width: 1_000, height: 100 } }]);
  disconnect = (): void => undefined;
}

test('the numbers of an axis are exact, however small its steps are', () => {
  expect([-0.0004, 0.00015, 0.1 + 0.2, 12_500].map(axisText)).toEqual([
    ...['\u22120.0004', '0.00015', '0.3', '12,500'],
  ]);
});

function said(
  sensor: string,
  known: number,
  moment: number | null = null,
  readings: readonly { at: number; value: number }[] = [],
): string {
  showTags([]);
  act({ moment });
  const value = timelineWith({ reach: { from: 100_000 - known, to: 100_000 } });
  receive({ remembered: { ...NOTHING, value } });
  const line = lineOf(seriesWith({ sensor, readings }));
  const model = plainModel(sensor, [line]);
  const { container } = render(<LineValue line={line} model={model} />);
  return container.textContent;
}

test('says what the marks are, and how many; where there are none, nothing', () => {
  const mark = { at: 1, widthS: 0, count: 2 } as const;
  const { rerender } = render(<MarksKey marks={[]} />);
  expect(screen.queryByTestId('marks-key')).toBeNull();
  const all = [mark, { ...mark, count: 1 }].map((each) => ({
    ...each,
    kind: 'inspection' as const,
  }));
  rerender(<MarksKey marks={[...all, { ...mark, kind: 'failure' }]} />);
  expect(screen.getByTestId('marks-key').textContent).toBe(
    '• 3 flower inspections✕ 2 failed attempts',
  );
  rerender(<MarksKey marks={all} />);
  expect(screen.getByTestId('marks-key').textContent).toBe('• 3 flower inspections');
});

const choices = (): string[] => screen.getAllByRole('option').map((option) => option.textContent);

beforeEach(() => {
  showTags([
    wireTag({ tag_id: '1', readings: readings({ light: 9000, ph: 7 }) }),
    wireTag({ tag_id: '2', readings: readings({ temperature: 20, humidity: 60 }) }),
  ]);
});

test('a tag’s sensors can be chosen, and what is computed of them', () => {
  const onChange = vi.fn();
  render(<SensorChoice tagId="1" value="light" onChange={onChange} />);
  expect(choices()).toEqual(['Light, lx', 'ph', 'Daily light integral, mol/m²/d']);
  fireEvent.change(screen.getByLabelText('Sensor'), { target: { value: 'daily_light_integral' } });
  expect(onChange).toHaveBeenCalledWith('daily_light_integral');
});

test('what takes two sensors needs both', () => {
  render(<SensorChoice tagId="2" value="temperature" onChange={vi.fn()} />);
  expect(choices()).toEqual([
    ...['Temperature, °C', 'Humidity, %', 'Vapour pressure deficit, kPa', 'Dew point, °C'],
    ...['Dew margin, K', '24-h mean temperature, °C', 'Night minimum, °C'],
    ...['Day-night difference (DIF), K', 'Growing degree days, °C·d'],
  ]);
});

test('what the card charts is no choice of the map’s, whose next choice it follows again', () => {
  act({ sensor: 'light' });
  render(<CardChart tagId="1" />);
  const choice = screen.getByLabelText('Sensor');
  expect(choice).toHaveProperty('value', 'light');
  fireEvent.change(choice, { target: { value: 'daily_light_integral' } });
  expect(choice).toHaveProperty('value', 'daily_light_integral');
  expect(store.get().view.sensor).toBe('light');
  flush(() => {
    act({ sensor: 'ph' });
  });
  expect(choice).toHaveProperty('value', 'ph');
});

test('what the map shows is no choice at a tag that lacks what it is computed of', () => {
  act({ sensor: 'vpd' });
  render(<CardChart tagId="1" />);
  expect(screen.getByLabelText('Sensor')).toHaveProperty('value', 'light');
});
