import { render } from '@testing-library/react';
import { expect, test } from 'vitest';

import { receive } from '../store/app';
import { NOT_ASKED } from '../store/twin';
import { showTags } from '../testing/page';
import { sensorNamed } from '../testing/sensors';
import { seriesWith } from '../testing/series';
import { timelineWith } from '../testing/timeline';
import { LineValue } from './LineValue';

test.each([
  ['temperature_24h_mean', 4_680, 'Needs 24 h of readings; 1\u00a0h 18\u00a0min so far'],
  ['daily_light_integral', 90_000, 'Needs 24 h of readings without a gap of over 3 h'],
  ['temperature', 4_680, '–'],
])('without a value %s says what it lacks', (sensor, known, said) => {
  showTags([]);
  const value = timelineWith({ reach: { from: 100_000 - known, to: 100_000 } });
  receive({ type: 'remembered', remembered: { ...NOT_ASKED, value } });
  const line = { series: seriesWith({ sensor }), before: null, look: 0, label: '1', marks: [] };
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
  expect(container.textContent).toBe(said);
});
