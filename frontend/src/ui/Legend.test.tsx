import { fireEvent, render, screen, within } from '@testing-library/react';
import { beforeEach, describe, expect, test } from 'vitest';

import { act, prefer, receive, store } from '../store/app';
import { fixedRange } from '../store/view';
import { showTags } from '../testing/page';
import { readings, wireTag } from '../testing/tags';
import { Legend } from './Legend';

beforeEach(() => {
  showTags([wireTag({ readings: readings({ temperature: 20 }) })]);
  receive({
    type: 'field',
    field: {
      state: 'ready',
      message: '',
      value: {
        sensor: 'temperature',
        width: 1,
        height: 1,
        originX: 0,
        originY: 0,
        resolution: 1,
        valueMin: 12.34,
        valueMax: 30,
        sampleCount: 9,
        values: Float32Array.of(20),
      },
    },
  });
});

const at = (id: string): string => screen.getByTestId(id).textContent;

describe('legend', () => {
  test('tells sensor, unit, range, how many contribute, and what transparent means', () => {
    render(<Legend kiosk={false} />);
    expect(at('legend')).toContain('Temperature °C');
    expect(at('range-low')).toBe('12.3');
    expect(at('range-high')).toBe('30.0\u00a0°C');
    expect(at('sample-count')).toBe('9 tags contribute');
    expect(at('legend')).toMatch(/No colour: the minimum, or not known/);
  });

  test('shows the error where the server gives one, and nothing where it does not', () => {
    const { rerender } = render(<Legend kiosk={false} />);
    expect(screen.queryByTestId('rmse')).toBeNull();
    receive({
      type: 'quality',
      quality: {
        sensor_type: 'temperature',
        unit: '°C',
        sample_count: 9,
        judged_count: 9,
        rmse: 1.5,
        worst: null,
        painted_share: 0.5,
      },
    });
    prefer({ unit: 'F' });
    rerender(<Legend kiosk={false} />);
    expect(at('rmse')).toBe('leave-one-out error ±2.7\u00a0°F');
  });

  test('a field of another sensor does not count', () => {
    act({ type: 'sensor', sensor: 'humidity' });
    render(<Legend kiosk={false} />);
    expect(at('sample-count')).toBe('No tag contributes');
  });

  test('a heat map on its way does not deny the tags that it will show', () => {
    showTags([wireTag({ readings: readings({ humidity: 60 }) })]);
    act({ type: 'sensor', sensor: 'humidity' });
    render(<Legend kiosk={false} />);
    expect(at('sample-count')).toBe('The heat map is on its way');
  });

  test('a fixed range stays while the data change, and can be typed', () => {
    render(<Legend kiosk={false} />);
    fireEvent.click(screen.getByRole('radio', { name: 'Fixed' }));
    const low = screen.getByLabelText(/^Lowest/);
    fireEvent.change(low, { target: { value: '15' } });
    fireEvent.blur(low);
    expect(fixedRange(store.get().view)).toMatchObject({ low: 15 });
    expect(at('range-low')).toBe('15.0');
    fireEvent.click(screen.getByRole('radio', { name: 'Auto' }));
    expect(fixedRange(store.get().view)).toBeNull();
  });

  test('a wall screen has no controls', () => {
    render(<Legend kiosk />);
    expect(screen.queryByRole('radio')).toBeNull();
  });

  test('has a key for every look of a pin', () => {
    render(<Legend kiosk={false} />);
    const keys = within(screen.getByRole('list')).getAllByRole('listitem');
    expect(keys.slice(0, 4).map((key) => key.textContent)).toEqual([
      'reading',
      'has no such sensor',
      'sensor failed',
      'pest seen',
    ]);
    // As on the map: an outline with a stroke through it, and neither filled nor dashed.
    expect(keys[2]?.querySelector('path')?.getAttribute('class')).toBe('key-pin failed');
  });
});
