import { render } from '@testing-library/react';
import { expect, test } from 'vitest';

import type { Series } from '../domain/series';
import { act, receive } from '../store/app';
import { NOT_ASKED } from '../store/twin';
import { showTags } from '../testing/page';
import { sensorNamed } from '../testing/sensors';
import { seriesWith } from '../testing/series';
import { timelineWith } from '../testing/timeline';
import { LineValue } from './PlotView';

test.each([
  ['temperature_24h_mean', 4_680, 'Needs 24 h of readings; 1\u00a0h 18\u00a0min so far'],
  ['daily_light_integral', 90_000, 'Needs 24 h of readings without a gap of over 3 h'],
  ['temperature', 4_680, '–'],
])('without a value %s says what it lacks', (sensor, known, told) => {
  expect(said(sensor, known)).toBe(told);
});

test('of a moment it counts what there was by then', () => {
  expect(said('temperature_24h_mean', 4_680, 98_920)).toMatch(/; 1\u00a0h 0\u00a0min so far$/);
});

test('with a value it says that', () => {
  const readings = [{ at: 99_000, value: 21 }];
  expect(said('temperature_24h_mean', 4_680, null, readings)).toContain('21.0\u00a0°C');
});

function said(
  sensor: string,
  known: number,
  moment: number | null = null,
  readings: Series['readings'] = [],
): string {
  showTags([]);
  act({ type: 'moment', moment });
  const value = timelineWith({ reach: { from: 100_000 - known, to: 100_000 } });
  receive({ type: 'remembered', remembered: { ...NOT_ASKED, value } });
  const line = {
    series: seriesWith({ sensor, readings }),
    before: null,
    look: 0,
    label: '1',
    marks: [],
  };
  const model = {
    ...{
      sensor: sensorNamed(sensor),
      unit: 'C' as const,
      lines: [line],
      bands: [],
      isMixed: false,
    },
    ...{ span: { from: 90_000, to: 100_000 }, moment: null },
  } as const;
  const { container } = render(<LineValue line={line} model={model} />);
  return container.textContent;
}
