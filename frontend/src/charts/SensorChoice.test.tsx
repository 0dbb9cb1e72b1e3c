import { fireEvent, render, screen } from '@testing-library/react';
import { beforeEach, expect, test } from 'vitest';

import { store } from '../store/app';
import { showTags } from '../testing/page';
import { readings, wireTag } from '../testing/tags';
import { SensorChoice } from './SensorChoice';

const choices = (): string[] => screen.getAllByRole('option').map((option) => option.textContent);

beforeEach(() => {
  showTags([
    wireTag({ tag_id: '1', readings: readings({ light: 9000, ph: 7 }) }),
    wireTag({ tag_id: '2', readings: readings({ temperature: 20, humidity: 60 }) }),
  ]);
});

test('a tag’s sensors can be chosen, and what is computed of them', () => {
  render(<SensorChoice tagId="1" value="light" />);
  expect(choices()).toEqual(['Light', 'ph', 'Daily light integral']);
  fireEvent.change(screen.getByLabelText('Sensor'), { target: { value: 'daily_light_integral' } });
  expect(store.get().view.sensor).toBe('daily_light_integral');
});

test('what takes two sensors needs both', () => {
  render(<SensorChoice tagId="2" value="temperature" />);
  expect(choices()).toEqual([
    ...['Temperature', 'Humidity', 'Vapour pressure deficit', 'Dew point', 'Dew margin'],
    ...['24-h mean temperature', 'Night minimum', 'Day-night difference (DIF)'],
    'Growing degree days',
  ]);
});
