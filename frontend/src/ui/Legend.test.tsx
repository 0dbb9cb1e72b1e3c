import { act as flush, fireEvent, render, screen, within } from '@testing-library/react';
import { beforeAll, beforeEach, describe, expect, test } from 'vitest';

import { act, prefer, receive, store } from '../store/app';
import { withField, withLatest, withPast } from '../store/twin';
import { fieldWith } from '../testing/field';
import { judgement, NOBODY, reason } from '../testing/health';
import { showField, showTags } from '../testing/page';
import { readings, wireTag } from '../testing/tags';
import { loadParts } from './loadDeferred';
import { Legend } from './Legend';

beforeAll(() => loadParts());

beforeEach(() => {
  showTags([wireTag({ readings: readings({ temperature: 20 }) })]);
  act({ colouring: 'value' });
  showField(fieldWith([[20]], { valueMin: 12.34, valueMax: 30, sampleCount: 9 }));
});

const at = (id: string): string => screen.getByTestId(id).textContent;

describe('legend', () => {
  test('tells sensor, unit, range, how many contribute, and what transparent means', () => {
    render(<Legend kiosk={false} />);
    expect(at('legend')).toContain('Temperature °C');
    expect(at('range-low')).toBe('12.0');
    expect(at('range-high')).toBe('30.0\u00a0°C');
    expect(at('sample-count')).toBe('9 tags contribute');
    expect(at('legend')).toMatch(/No colour: minimum\.\s+Hatched: no data/);
  });

  test('shows the error where the server gives one, and nothing where it does not', () => {
    const { rerender } = render(<Legend kiosk={false} />);
    expect(screen.queryByTestId('rmse')).toBeNull();
    receive(
      withLatest({
        quality: {
          sensor_type: 'temperature',
          unit: '°C',
          sample_count: 9,
          judged_count: 9,
          rmse: 1.5,
          worst: null,
          painted_share: 0.5,
          far_off_tags: [],
        },
      }),
    );
    prefer({ unit: 'F' });
    rerender(<Legend kiosk={false} />);
    expect(at('rmse')).toBe('Typical error 2.7\u00a0°F');
    // It is the map's, not that of a difference.
    act({ compare: 'day' });
    rerender(<Legend kiosk={false} />);
    expect(screen.queryByTestId('rmse')).toBeNull();
    act({ compare: null });
  });

  test('says what is readings too old, by both colourings, and of no moment when nothing was', () => {
    const { rerender } = render(<Legend kiosk={false} />);
    expect(screen.queryByTestId('legend-old')).toBeNull();
    const { field } = store.get().twin.latest;
    const old = reason({ kind: 'old', verdict: 'unknown', sensor: '' });
    const wire = wireTag({ readings: readings({ temperature: 20 }) });
    showTags([wire], judgement({ [wire.tag_id]: [old] }));
    receive(withField(field));
    for (const colouring of ['ideal', 'value'] as const) {
      act({ colouring });
      rerender(<Legend kiosk={false} />);
      expect(at('legend-old')).toBe(' Faint and hatched: readings too old');
    }
    const { latest } = store.get().twin;
    receive(withPast({ at: 50, house: { ...latest, health: NOBODY } }));
    act({ moment: 50 });
    rerender(<Legend kiosk={false} />);
    expect(screen.queryByTestId('legend-old')).toBeNull();
  });

  test('a kept range stays while the values change', () => {
    render(<Legend kiosk={false} />);
    const keep = screen.getByRole('checkbox', { name: 'Keep this range' });
    fireEvent.click(keep);
    flush(() => {
      showField(fieldWith([[40]], { valueMin: 2, valueMax: 50 }));
    });
    expect([at('range-low'), at('range-high')]).toEqual(['12.0', '30.0\u00a0°C']);
    fireEvent.click(keep);
    expect([at('range-low'), at('range-high')]).toEqual(['0.0', '50.0\u00a0°C']);
  });

  test('a field of another sensor does not count', () => {
    act({ sensor: 'humidity' });
    render(<Legend kiosk={false} />);
    expect(at('sample-count')).toBe('No tag contributes');
  });

  test('a heat map on its way does not deny the tags that it will show', () => {
    showTags([wireTag({ readings: readings({ humidity: 60 }) })]);
    act({ sensor: 'humidity' });
    render(<Legend kiosk={false} />);
    expect(at('sample-count')).toBe('Loading the heat map');
  });

  test('tells what the colours mean against the ideal, and has one click to either', () => {
    act({ colouring: 'ideal' });
    const species = {
      species: 'Tulip',
      species_confidence: 0.8,
      readings: readings({ temperature: 20 }),
    };
    showTags([wireTag(species)], judgement({}, { is_day: false, source: 'light' }));
    render(<Legend kiosk={false} />);
    const parts = (): (string | null)[] =>
      [...screen.getByTestId('ideal-scale').querySelectorAll('[data-part]')].map(
        (part) => part.textContent,
      );
    expect(parts()).toEqual(['too low', 'night-time ideal per species ', 'too high']);
    expect(at('ideal-species')).toBe(
      'Tulip 8.0\u00a0to\u00a018.0\u00a0°C; others 15.0\u00a0to\u00a024.0\u00a0°C',
    );
    flush(() => {
      showTags(
        [wireTag({ ...species, species: 'Fern' })],
        judgement({}, { is_day: false, source: 'light' }),
      );
    });
    expect(parts()).toEqual([
      'too low below 15.0',
      'night-time ideal 15.0\u00a0to\u00a024.0\u00a0°C',
      'too high above 24.0\u00a0°C',
    ]);
    fireEvent.click(screen.getByRole('radio', { name: 'Value' }));
    expect(screen.queryByTestId('ideal-scale')).toBeNull();
    expect(store.get().view.colouring).toBe('value');
    fireEvent.click(screen.getByRole('radio', { name: 'Ideal' }));
    expect(screen.queryByTestId('range-low')).toBeNull();
  });

  test('a sensor without an ideal is coloured by value, and says so', () => {
    act({ colouring: 'ideal' });
    act({ sensor: 'dew_point' });
    render(<Legend kiosk={false} />);
    expect(at('no-ideal')).toContain('coloured by value');
    expect(screen.queryByRole('radio', { name: 'Ideal' })).toBeNull();
    expect(screen.getByTestId('range-low')).toBeTruthy();
  });

  test('tells of a difference alone while there is one, and has nothing to choose its colours by', () => {
    act({ compare: 'day' });
    render(
      <div className="layers">
        <button>Layers</button>
        <Legend kiosk={false} />
      </div>,
    );
    expect(screen.getByTestId('difference-legend')).toBeTruthy();
    expect(screen.queryByTestId('range-low')).toBeNull();
    expect(screen.queryByRole('radio')).toBeNull();
    fireEvent.click(screen.getByRole('button', { name: 'Stop comparing' }));
    expect(screen.getByTestId('range-low')).toBeTruthy();
    // The button is gone; its focus must not be.
    expect(document.activeElement).toBe(screen.getByRole('button', { name: 'Layers' }));
  });

  test('a wall screen has no controls', () => {
    render(<Legend kiosk />);
    expect(screen.queryByRole('radio')).toBeNull();
  });

  test('has a key for every look of a pin', () => {
    render(<Legend kiosk={false} />);
    const keys = within(screen.getByRole('list')).getAllByRole('listitem');
    expect(keys.slice(0, 7).map((key) => key.textContent)).toEqual([
      'Critical',
      'Stressed',
      'Unknown',
      'Healthy',
      'No sensor',
      'Sensor failed',
      'Pest seen',
    ]);
    // The same marks as on the map.
    expect(keys[0]?.querySelector('[data-health=critical] .body')).not.toBeNull();
  });
});
