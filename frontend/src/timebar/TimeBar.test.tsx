import { fireEvent, act as flush, render, screen } from '@testing-library/react';
import { beforeEach, describe, expect, test, vi } from 'vitest';

import { timelineOf } from '../domain/timeline';
import { act, receive, store } from '../store/app';
import { pointedTime } from '../store/create';
import { NO_HOUSE, NO_TWIN, withPast, withState } from '../store/twin';
import { goLive, goLost, showTags, status } from '../testing/page';
import { stateFrame, wireTag } from '../testing/tags';
import { wireTimeline } from '../testing/timeline';
import { fieldOf, momentOf, TimeBar } from './TimeBar';

const NOW = 10_000;

const remember = (from: number, to: number, oldest = from): void => {
  const buckets = [
    { start: 9_000, scans: 3, failures: 1, looks: 0, pests_seen: 1, pests_cleared: 0 },
  ];
  const value = timelineOf(
    wireTimeline({ from, to, reach: { from: oldest, to }, bucket_s: 15, buckets }),
    NOW,
  );
  receive({ remembered: { value, state: 'ready', message: '' } });
};

/** Stub ResizeObserver: the bar is as wide as a screen. */
class Laid {
  constructor(private readonly callback: (entries: readonly object[]) => void) {}
  observe = (): void => {
    this.callback([{ contentRect: { width: 1_000, height: 62 } }]);
  };
  disconnect = (): void => undefined;
}

beforeEach(() => {
  // Freeze the page's clock.
  vi.spyOn(performance, 'now').mockReturnValue(performance.now());
  vi.stubGlobal('ResizeObserver', Laid);
  showTags([wireTag()]);
  const latest = stateFrame([wireTag()], { sec: NOW });
  receive(withState(latest, performance.now()));
  act({ period: { kind: 'hour' } });
  remember(9_000, NOW);
});

const slider = (): HTMLElement => screen.getByRole('slider', { name: 'Time shown' });
const moment = (): number | null => store.get().view.moment;
const cursor = (): DOMStringMap =>
  document.querySelector<HTMLElement>('.timebar-cursor')?.dataset ?? {};

describe('the mouse on a chart and on the bar', () => {
  const pointed = (): HTMLElement | null => screen.queryByTestId('timebar-pointed');

  test('what is pointed at in a chart is drawn on the bar, where it has it', () => {
    render(<TimeBar />);
    expect(pointed()).toBeNull();
    flush(() => {
      pointedTime.set(9_500);
    });
    expect(pointed()?.style.left).toBe('500px');
    flush(() => {
      pointedTime.set(8_900);
    });
    expect(pointed()).toBeNull();
  });

  test('the time pointed at on the bar is marked in the charts, and not drawn twice', () => {
    render(<TimeBar />);
    fireEvent.pointerMove(slider(), { clientX: 250 });
    expect(pointedTime.get()).toBe(9_250);
    expect(pointed()).toBeNull();
    fireEvent.pointerLeave(slider());
    expect(pointedTime.get()).toBeNull();
  });
});

test('the end of the bar is not live while the page is not', () => {
  render(<TimeBar />);
  const said = (): string[] => [
    screen.getByTestId('timebar-when').textContent,
    slider().getAttribute('aria-valuetext') ?? '',
  ];
  expect(said()).toEqual(['Live', 'Live']);
  flush(() => {
    goLive(status({ twin: 'offline', reason: 'stale' }));
  });
  expect(said()).toEqual(['Twin offline', 'Twin offline']);
  flush(() => {
    goLive(status({ twin: 'offline', reason: 'clock_stopped' }));
  });
  expect(said()).toEqual(['Time unknown', 'Time unknown']);
  flush(goLost);
  expect(said()).toEqual(['Reconnecting', 'Reconnecting']);
});

test('the bar of a young twin begins with its history, but an own period as chosen', () => {
  remember(6_400, NOW, 9_000);
  render(<TimeBar />);
  expect(slider().dataset['span']).toBe('9000,10000');
  flush(() => {
    act({ period: { kind: 'own', from: 6_400, to: NOW } });
  });
  expect(slider().dataset['span']).toBe('6400,10000');
});

test('how fast the past is played is chosen where there is a past to play', () => {
  render(<TimeBar />);
  expect(screen.queryByLabelText('Playback speed')).toBeNull();
  flush(() => {
    act({ moment: 9_004 });
  });
  expect(screen.getByLabelText('Playback speed')).toBeTruthy();
});

const at = (clientX: number): object => ({ clientX, button: 0, pointerId: 1 });

describe('the slider', () => {
  test('says where it stands, in words', () => {
    render(<TimeBar />);
    expect(slider().getAttribute('aria-valuetext')).toBe('Live');
    expect(slider().getAttribute('aria-valuenow')).toBe(`${NOW}`);
    flush(() => {
      act({ moment: 9_004 });
    });
    expect(slider().getAttribute('aria-valuetext')).toBe(
      'sim 02:30:04, 3 scans, 1 failed, 1 pest seen',
    );
    expect(slider().getAttribute('aria-valuenow')).toBe('9004');
    expect(cursor()['live']).toBe('false');
  });

  test('has nothing right of now: the last bucket ends there', () => {
    render(<TimeBar />);
    flush(() => {
      remember(9_004, NOW + 4);
    });
    expect(document.querySelector<HTMLElement>('.timebar-cursor')?.style.left).toBe('1000px');
  });

  test('steps by a pixel, by ten, by a tenth, to its ends, and into now', () => {
    render(<TimeBar />);
    const press = (key: string, shiftKey = false): number | null => {
      fireEvent.keyDown(slider(), { key, shiftKey });
      return moment();
    };
    expect(press('ArrowLeft')).toBe(NOW - 1);
    expect(press('ArrowLeft', true)).toBe(NOW - 11);
    expect(press('ArrowRight')).toBe(NOW - 10);
    expect(press('PageDown')).toBe(NOW - 110);
    expect(press('PageUp')).toBe(NOW - 10);
    expect(press('ArrowRight', true)).toBeNull();
    expect(press('Home')).toBe(9_000);
    expect(press('ArrowLeft')).toBe(9_000);
    expect(press('End')).toBeNull();
    expect(press('x')).toBeNull();
  });

  test('follows the pointer while it is held, on a bar that stays where it is', () => {
    render(<TimeBar />);
    fireEvent.pointerMove(slider(), at(300));
    expect(moment()).toBeNull();
    fireEvent.pointerDown(slider(), at(500));
    expect(moment()).toBe(9_500);
    flush(() => {
      remember(9_100, NOW + 100);
    });
    fireEvent.pointerMove(slider(), at(200));
    expect(moment()).toBe(9_200);
    fireEvent.pointerUp(slider(), at(200));
    fireEvent.pointerMove(slider(), at(800));
    expect(moment()).toBe(9_200);
    expect(slider().dataset['span']).toBe('9100,10100');
  });

  test('takes the bubble beside the mouse away with the click: the header has the moment', () => {
    render(<TimeBar />);
    const bubble = (): Element | null => document.querySelector('.timebar-bubble');
    fireEvent.pointerMove(slider(), at(500));
    expect(bubble()).not.toBeNull();
    fireEvent.pointerDown(slider(), at(500));
    fireEvent.pointerUp(slider(), at(500));
    expect(bubble()).toBeNull();
  });

  test('is hollow while its moment is on the way, and shows what has come', () => {
    receive(withPast({ at: 9_700, house: NO_HOUSE }));
    act({ moment: 9_500 });
    render(<TimeBar />);
    expect(cursor()['awaited']).toBe('true');
    expect(document.querySelector<HTMLElement>('.timebar-arrived')?.style.left).toBe('700px');
    flush(() => {
      receive(withPast({ at: 9_500, house: NO_HOUSE }));
    });
    expect(cursor()['awaited']).toBe('false');
  });

  test('a moment beyond its ends is marked at the end', () => {
    act({ moment: 500 });
    render(<TimeBar />);
    expect(cursor()['outside']).toBe('true');
    expect(slider().getAttribute('aria-valuetext')).toBe('sim 00:08:20');
  });
});

describe('the period', () => {
  test('is one of a few, or begins as what is in view', () => {
    render(<TimeBar />);
    const choice = screen.getByLabelText('Period');
    fireEvent.change(choice, { target: { value: 'own' } });
    expect(store.get().view.period).toEqual({ kind: 'own', from: 9_000, to: NOW });
    const from = screen.getByLabelText<HTMLInputElement>('From');
    expect(from.value).toBe('2:30:00');
    fireEvent.change(from, { target: { value: '2:00:00' } });
    expect(store.get().view.period).toMatchObject({ from: 7_200 });
    fireEvent.change(from, { target: { value: '9:00:00' } });
    expect(store.get().view.period).toMatchObject({ from: 7_200 });
    expect(from.getAttribute('aria-invalid')).toBe('true');
    expect(screen.getByText('hh:mm:ss since the simulation began')).not.toBeNull();
    fireEvent.change(choice, { target: { value: 'week' } });
    expect(store.get().view.period).toEqual({ kind: 'week' });
  });

  test('is in its fields the one that a chart or a link has chosen since', () => {
    act({ period: { kind: 'own', from: 3_600.5, to: 7_200 } });
    render(<TimeBar />);
    const fields = (): string[] =>
      ['From', 'To'].map((name) => screen.getByLabelText<HTMLInputElement>(name).value);
    fireEvent.change(screen.getByLabelText('To'), { target: { value: '1:30' } });
    expect(fields()).toEqual(['1:00:00', '1:30']);
    expect(store.get().view.period).toMatchObject({ from: 3_600.5, to: 5_400 });
    flush(() => {
      act({ period: { kind: 'own', from: 4_000, to: 5_000 } });
    });
    expect(fields()).toEqual(['1:06:40', '1:23:20']);
  });
});

test('a failed fetch is reported beside what is known', () => {
  const { remembered } = store.get().twin;
  receive({ remembered: { ...remembered, state: 'failed', message: 'too busy' } });
  render(<TimeBar />);
  expect(screen.getByTestId('timebar').textContent).toContain('too busy');
  expect(slider()).not.toBeNull();
  // A journal that cannot be read is told of above, with the true reason.
  const { journal } = status();
  flush(() => {
    goLive(status({ journal: { ...journal, state: 'foreign' } }));
  });
  expect(screen.getByTestId('timebar').textContent).not.toContain('too busy');
  // Without a connection, the banner says so instead.
  flush(goLive);
  expect(screen.getByTestId('timebar').textContent).toContain('too busy');
  flush(goLost);
  expect(screen.getByTestId('timebar').textContent).not.toContain('too busy');
});

test('before the twin’s time is known there is no bar', () => {
  vi.spyOn(store, 'get').mockReturnValue({ ...store.get(), twin: NO_TWIN });
  const { container } = render(<TimeBar />);
  expect(container.childElementCount).toBe(0);
});

// A half-hour offset, set before any module reads the clock.
vi.hoisted(() => {
  vi.stubEnv('TZ', 'Asia/Kolkata');
});

const AT = Date.UTC(2026, 10, 13, 21, 42, 5) / 1000;

test('a date is on the operator’s clock, there and back', () => {
  expect(fieldOf(AT + 0.9, false)).toBe('2026-11-14T03:12:05');
  expect(momentOf('2026-11-14T03:12:05', false)).toBe(AT);
  expect(momentOf('2026-11-14T03:12', false)).toBe(AT - 5);
});

test('a simulation counts hours from its beginning', () => {
  expect(fieldOf(3_723, true)).toBe('1:02:03');
  expect(momentOf('1:02:03', true)).toBe(3_723);
  expect(momentOf(' 100:00 ', true)).toBe(360_000);
});

test.each([
  ['', false],
  ['yesterday', false],
  ['2026-11', false],
  ['1960-01-01T00:00', false],
  ['', true],
  ['1:60:00', true],
  ['7', true],
])('%j is no time', (text, isSimulated) => {
  expect(momentOf(text, isSimulated)).toBeNull();
});
