import { readFileSync } from 'node:fs';
import { join } from 'node:path';

import { act as flush, fireEvent, render, screen, within } from '@testing-library/react';
import { beforeAll, beforeEach, describe, expect, test, vi } from 'vitest';

import { mapPoint } from '../geometry/coordinates';
import { pointedAt } from '../map/commands';
import { act, receive, store } from '../store/app';
import { NO_HOUSE, withPast } from '../store/twin';
import { S } from '../strings';
import { judgement, reason } from '../testing/health';
import { fieldWith } from '../testing/field';
import { goLive, goLost, showField, showTags, status } from '../testing/page';
import { readings, wireTag } from '../testing/tags';
import { App } from './App';
import { ErrorBoundary } from './ErrorBoundary';
import { loadParts } from './loadDeferred';
import * as reload from './reload';

beforeAll(() => loadParts());

beforeEach(() => {
  vi.stubGlobal('fetch', () => Promise.reject(new Error('no server')));
  showTags(
    [
      wireTag({ tag_id: '1', readings: readings({ temperature: 20 }) }),
      wireTag({ tag_id: '2', readings: readings({ co2: 3200 }), anomaly: true, bug_count: 4 }),
    ],
    judgement({
      1: 'healthy',
      2: [
        reason({ sensor: 'co2', value: 3200, limit: 3000 }),
        reason({ kind: 'pest', sensor: '', value: 4, limit: null }),
      ],
    }),
  );
});

const app = (): HTMLElement => screen.getByTestId('app');
const goBack = (): void => {
  act({ moment: 500 });
  receive(withPast({ at: 500, house: NO_HOUSE }));
};

describe('page', () => {
  test('which cannot show what an updated server sends says so, and loads anew', () => {
    vi.spyOn(console, 'error').mockImplementation(() => undefined);
    vi.spyOn(reload, 'reloadByItself').mockReturnValue(() => undefined);
    render(
      <ErrorBoundary>
        <App kiosk={false} />
      </ErrorBoundary>,
    );
    const { type, twin, reason } = status();
    flush(() => {
      goLive({ type, twin, reason } as ReturnType<typeof status>);
    });
    expect(screen.getByTestId('failed-page').textContent).toContain('reloads automatically');
    expect(reload.reloadByItself).toHaveBeenCalledOnce();
  });

  test('carries the connection’s state for style sheets and tests', () => {
    render(<App kiosk={false} />);
    expect(app().dataset).toMatchObject({ connectionState: 'live', fresh: 'true' });
    const shapes = (): number =>
      screen.getByTestId('connection').querySelectorAll('svg > *').length;
    expect(shapes()).toBe(1);
    flush(goLost);
    expect(shapes()).toBe(1);
    expect(app().dataset).toMatchObject({ connectionState: 'reconnecting', fresh: 'false' });
  });

  test('cut off, alarms do not look current, whatever moment the rest shows', () => {
    const style = document.head.appendChild(document.createElement('style'));
    style.textContent = readFileSync(join(import.meta.dirname, '../styles/frozen.css'), 'utf8');
    render(<App kiosk={false} />);
    const row = app().appendChild(document.createElement('button'));
    row.className = 'alarm-go';
    const looks: string[] = [];
    for (const change of [goLost, goBack, goLive]) {
      flush(change);
      looks.push(getComputedStyle(row).filter);
    }
    expect(looks).toEqual(['grayscale(1)', 'grayscale(1)', '']);
    row.remove();
    style.remove();
  });

  test('while a moment loads nothing is counted or judged, and no alarm before it is known', () => {
    render(<App kiosk={false} />);
    flush(goBack);
    expect(screen.getByTestId('row-count').textContent).toBe('');
    expect(screen.getByTestId('sample-count').textContent).toBe(S.legendFetching);
    const tabs = screen.getByRole('navigation', { name: /Map/ });
    expect(tabs.querySelector('[data-health]')).toBeNull();
    expect(tabs.textContent).toMatch(/Alarms$/);
    const at = store.get().view.moment ?? NaN;
    flush(() => {
      receive({ pastFault: { at, message: 'later than now', isLasting: true } });
    });
    expect(screen.getByTestId('sample-count').textContent).toBe('No tag contributes');
  });

  test('choosing a sensor is choosing a radio button', () => {
    render(<App kiosk={false} />);
    const sensors = screen.getByRole('group', { name: 'Sensor' });
    fireEvent.click(within(sensors).getByRole('radio', { name: /CO₂/ }));
    expect(store.get().view.sensor).toBe('co2');
    // No tag measures humidity.
    expect(within(sensors).queryByRole('radio', { name: /Humidity/ })).toBeNull();
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

  test('the read-out shows the field’s value under the pointer, or that it is not known', () => {
    showField(fieldWith([[21, NaN]]));
    render(<App kiosk={false} />);
    const readout = (x: number): string => {
      flush(() => {
        pointedAt.set(mapPoint(x, 0.5));
      });
      return screen.getByTestId('readout').textContent;
    };
    expect(readout(0.5)).toContain('21.0\u00a0°C');
    expect(readout(1.5)).toContain('unknown');
    flush(() => {
      pointedAt.set(null);
    });
    expect(screen.queryByTestId('readout')).toBeNull();
  });

  test('a narrow screen switches between map and table', () => {
    render(<App kiosk={false} />);
    const panes = screen.getByRole('navigation');
    fireEvent.click(within(panes).getByRole('button', { name: /Tags/ }));
    expect(app().dataset['pane']).toBe('tags');
  });

  test('a wall screen shows what needs attention and why, and nothing to press', () => {
    render(<App kiosk />);
    expect(screen.queryByRole('button', { name: 'Menu' })).toBeNull();
    expect(screen.queryByRole('table')).toBeNull();
    const [first, second] = document.querySelectorAll('.attention > ul > li');
    expect(first?.textContent).toContain('4 pests seen');
    expect(second?.textContent).toContain('CO₂ 3,200');
  });
});
