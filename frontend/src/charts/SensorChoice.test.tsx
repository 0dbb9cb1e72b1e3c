import { act as flush, fireEvent, render, screen } from '@testing-library/react';
import { beforeEach, expect, test, vi } from 'vitest';

import { act, store } from '../store/app';
import { showTags } from '../testing/page';
import { readings, wireTag } from '../testing/tags';
import CardChart from './CardChart';
import { SensorChoice } from './PlotView';

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
  expect(choices()).toEqual(['Light', 'ph', 'Daily light integral']);
  fireEvent.change(screen.getByLabelText('Sensor'), { target: { value: 'daily_light_integral' } });
  expect(onChange).toHaveBeenCalledWith('daily_light_integral');
});

test('what takes two sensors needs both', () => {
  render(<SensorChoice tagId="2" value="temperature" onChange={vi.fn()} />);
  expect(choices()).toEqual([
    ...['Temperature', 'Humidity', 'Vapour pressure deficit', 'Dew point', 'Dew margin'],
    ...['24-h mean temperature', 'Night minimum', 'Day-night difference (DIF)'],
    'Growing degree days',
  ]);
});

test('what the card charts is no choice of the map’s, whose next choice it follows again', () => {
  act({ type: 'sensor', sensor: 'light' });
  render(<CardChart tagId="1" />);
  const choice = screen.getByLabelText('Sensor');
  expect(choice).toHaveProperty('value', 'light');
  fireEvent.change(choice, { target: { value: 'daily_light_integral' } });
  expect(choice).toHaveProperty('value', 'daily_light_integral');
  expect(store.get().view.sensor).toBe('light');
  flush(() => {
    act({ type: 'sensor', sensor: 'ph' });
  });
  expect(choice).toHaveProperty('value', 'ph');
});

test('what the map shows is no choice at a tag that lacks what it is computed of', () => {
  act({ type: 'sensor', sensor: 'vpd' });
  render(<CardChart tagId="1" />);
  expect(screen.getByLabelText('Sensor')).toHaveProperty('value', 'light');
});
