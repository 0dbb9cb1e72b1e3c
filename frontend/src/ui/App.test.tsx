import { act as flush, fireEvent, render, screen, within } from '@testing-library/react';
import { beforeEach, describe, expect, test, vi } from 'vitest';

import { mapPoint } from '../geometry/coordinates';
import { pointedAt } from '../map/pointer';
import { receive, store } from '../store/app';
import { goLost, showTags } from '../testing/page';
import { readings, wireTag } from '../testing/tags';
import { App } from './App';

beforeEach(() => {
  vi.stubGlobal('fetch', () => Promise.reject(new Error('no server')));
  Object.defineProperty(document, 'fonts', {
    configurable: true,
    value: new EventTarget(),
  });
  showTags([
    wireTag({ tag_id: '1', readings: readings({ temperature: 20 }) }),
    wireTag({ tag_id: '2', readings: readings({ co2: 3000 }), anomaly: true, bug_count: 4 }),
  ]);
});

const app = (): HTMLElement => screen.getByTestId('app');

describe('page', () => {
  test('carries the connection’s state for style sheets and tests', () => {
    render(<App kiosk={false} />);
    expect(app().dataset).toMatchObject({ connectionState: 'live', fresh: 'true' });
    flush(goLost);
    expect(app().dataset).toMatchObject({ connectionState: 'reconnecting', fresh: 'false' });
  });

  test('choosing a sensor is choosing a radio button', () => {
    render(<App kiosk={false} />);
    const sensors = screen.getByRole('group', { name: 'Sensor' });
    fireEvent.click(within(sensors).getByRole('radio', { name: /Humidity/ }));
    expect(store.get().view.sensor).toBe('humidity');
  });

  test('layers go on and off', () => {
    render(<App kiosk={false} />);
    fireEvent.click(screen.getByRole('button', { name: 'Layers' }));
    fireEvent.click(screen.getByRole('checkbox', { name: 'Blooms' }));
    expect(store.get().view.layers.has('blooms')).toBe(false);
  });

  test('the menu changes unit and theme', () => {
    render(<App kiosk={false} />);
    fireEvent.click(screen.getByRole('button', { name: 'Menu' }));
    fireEvent.click(screen.getByRole('radio', { name: '°F' }));
    fireEvent.click(screen.getByRole('radio', { name: 'Dark' }));
    expect(store.get().settings).toMatchObject({ unit: 'F', theme: 'dark' });
  });

  test('the filter counts what it leaves', () => {
    render(<App kiosk={false} />);
    fireEvent.change(screen.getByRole('searchbox'), { target: { value: 'pest' } });
    expect(screen.getByTestId('row-count').textContent).toBe('1 of 2 tags');
  });

  test('the read-out tells the field’s value under the pointer, or that it is not known', () => {
    receive({
      type: 'field',
      field: {
        state: 'ready',
        message: '',
        value: {
          sensor: 'temperature',
          width: 2,
          height: 1,
          originX: 0,
          originY: 0,
          resolution: 1,
          valueMin: 21,
          valueMax: 21,
          sampleCount: 1,
          values: Float32Array.of(21, NaN),
        },
      },
    });
    render(<App kiosk={false} />);
    const readout = (x: number): string => {
      flush(() => {
        pointedAt.dispatch(mapPoint(x, 0.5));
      });
      return screen.getByTestId('readout').textContent;
    };
    expect(readout(0.5)).toContain('21.0\u00a0°C');
    expect(readout(1.5)).toContain('not known');
    flush(() => {
      pointedAt.dispatch(null);
    });
    expect(screen.queryByTestId('readout')).toBeNull();
  });

  test('a narrow screen switches between map and table', () => {
    render(<App kiosk={false} />);
    const panes = screen.getByRole('navigation');
    fireEvent.click(within(panes).getByRole('button', { name: /Tags/ }));
    expect(app().dataset['pane']).toBe('tags');
  });

  test('a wall screen shows what needs attention, pests first, and nothing to press', () => {
    render(<App kiosk />);
    expect(screen.queryByRole('button', { name: 'Menu' })).toBeNull();
    expect(screen.queryByRole('table')).toBeNull();
    const [first] = document.querySelectorAll('.attention li');
    expect(first?.textContent).toContain('4 bugs');
    expect(first?.textContent).toContain('CO₂ 3000');
  });
});
