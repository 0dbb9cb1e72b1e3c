/** Alarms outside the list: title, icon, voices, sound, notification. */
import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest';

import pushes from '../../public/sw.js?raw';
import type { Alarm } from '../contract/types';
import { act, prefer, receive, store } from '../store/app';
import { announce } from '../store/create';
import { NO_HOUSE, withPast } from '../store/twin';
import { started } from '../testing/life';
import { alarm, reportAlarms } from '../testing/alarms';
import { judgement, reason } from '../testing/health';
import { goLive, goLost, showTags } from '../testing/page';
import { readings, wireTag } from '../testing/tags';
import {
  badgeOf,
  isPushed,
  notifyState,
  QUIET_MS,
  soundState,
  startBadge,
  startNotify,
  startSound,
  setNotify,
  setSound,
} from './notify';
import { acknowledgeAlarms, NO_LOCAL_ALARMS, own } from './own';
import { calling } from './list';
import {
  alarmList,
  politeVoice,
  startAlarms,
  startTitle,
  startVoices,
  titleOf,
  urgentVoice,
} from './watch';

const STRESSED = { verdict: 'stressed' } as const;
const cold = alarm('cold', { tag_id: '1' });
const warm = alarm('warm', { tag_id: '2', reason: { ...STRESSED, value: 30, limit: 26 } });
let stops: (() => void)[];

const start = (...starts: ((signal: AbortSignal) => void)[]): void => {
  stops = [startAlarms, ...starts].map(started);
  // The alarms that the page starts with.
  reportAlarms();
};

beforeEach(() => {
  own.set(NO_LOCAL_ALARMS);
  showTags([wireTag()]);
});
afterEach(() => {
  for (const stop of stops.reverse()) stop();
  vi.restoreAllMocks();
  vi.unstubAllGlobals();
});

describe('title', () => {
  test('counts what is active, acknowledged or not, and says which moment is shown', () => {
    start(startTitle);
    expect(document.title).toBe('Lupin twin');
    reportAlarms(cold, warm, alarm('over', { cleared: 950 }));
    expect(document.title).toBe('(2) Lupin twin');
    act({ moment: 50 });
    receive(withPast({ at: 50, house: NO_HOUSE }));
    expect(document.title).toBe('(2) sim 00:00:50 (past) · Lupin twin');
    acknowledgeAlarms(calling(alarmList.get()));
    expect(document.title).toBe('(2) sim 00:00:50 (past) · Lupin twin');
    reportAlarms();
    expect(document.title).toBe('sim 00:00:50 (past) · Lupin twin');
    expect(titleOf('0', null)).toBe('Lupin twin');
    expect(titleOf('2', null, 'Recorded')).toBe('(2) Recorded · Lupin twin');
  });

  test('without a connection does not pass for one that has no alarms', () => {
    start(startTitle);
    goLost();
    expect(document.title).toBe('Reconnecting · Lupin twin');
    goLive();
    expect(document.title).toBe('Lupin twin');
  });
});

describe('icon', () => {
  test('has the number, the worst by form and colour, and is the page’s own again', () => {
    const link = document.createElement('link');
    link.rel = 'icon';
    link.href = './lupin.svg';
    document.head.append(link);
    start(startBadge);
    const drawn = (): string => decodeURIComponent(link.href);
    expect(link.href).toMatch(/\/lupin\.svg$/);
    reportAlarms(warm);
    expect(drawn()).toMatch(/^data:image\/svg\+xml,<svg .*<circle.*>1<\/text>/);
    reportAlarms(warm, cold);
    expect(drawn()).toMatch(/<path.*>2<\/text>/);
    // As on the alarms' button, by what they are now, not by what they were at worst.
    const mild = reason({ value: 12, limit: 18, verdict: 'stressed' });
    showTags([wireTag({ readings: readings({ temperature: 12 }) })], judgement({ 1: [mild] }));
    expect(drawn()).toMatch(/<circle.*>2<\/text>/);
    reportAlarms();
    expect(link.href).toMatch(/\/lupin\.svg$/);
    link.remove();
  });

  test('above nine it shows 9+', () => {
    expect(badgeOf(0, 'critical')).toBeNull();
    expect(decodeURIComponent(badgeOf(9, 'critical') ?? '')).toContain('>9<');
    expect(decodeURIComponent(badgeOf(10, 'critical') ?? '')).toContain('>9+<');
  });
});

describe('voices', () => {
  const said = (): string[] => [politeVoice.get().text, urgentVoice.get().text];
  const keys = (): number => politeVoice.get().key + urgentVoice.get().key;

  test('one announcement a change; only a critical alarm cuts in', () => {
    announce(politeVoice, '');
    announce(urgentVoice, '');
    start(startVoices);
    const before = keys();
    reportAlarms(warm);
    expect(said()).toEqual(['New: Tag 2: Temperature above 26.0\u00a0°C, worst 30.0\u00a0°C', '']);
    reportAlarms(cold, warm, alarm('other', { tag_id: '3' }));
    expect(said()[1]).toMatch(/^New: Tag 1: [^;]*; Tag 3: [^;]*$/);
    expect(keys()).toBe(before + 2);
    // Neither a frame without news nor a state announces anything.
    reportAlarms(cold, warm, alarm('other', { tag_id: '3' }));
    showTags([wireTag()]);
    expect(keys()).toBe(before + 2);
  });

  test('a resolved alarm is announced once, together with new ones', () => {
    start(startVoices);
    reportAlarms(warm);
    reportAlarms({ ...warm, cleared_at: 990 }, alarm('x', { reason: STRESSED }));
    expect(said()[0]).toMatch(/^New: Tag 1: .*\. Resolved: Tag 2: Temperature/);
  });
});

/** The part of Web Audio that the sound uses, which jsdom lacks. */
class Audio {
  state: 'suspended' | 'running';
  notes = 0;
  currentTime = 0;
  destination = {};
  constructor(readonly allowed: boolean) {
    this.state = 'suspended';
  }
  resume(): Promise<void> {
    if (this.allowed) this.state = 'running';
    return Promise.resolve();
  }
  close(): Promise<void> {
    return Promise.resolve();
  }
  createOscillator(): unknown {
    this.notes += 1;
    const ignore = (): void => undefined;
    const node = {
      frequency: { value: 0 },
      connect: (next: unknown) => next,
      start: ignore,
      stop: ignore,
    };
    return node;
  }
  createGain(): unknown {
    const gain = { setValueAtTime: () => gain, linearRampToValueAtTime: () => gain };
    return { gain, connect: (next: unknown) => next };
  }
}

describe('sound', () => {
  const stubAudio = (audio: Audio): void => {
    vi.stubGlobal('AudioContext', function make() {
      return audio;
    });
  };
  const many = (count: number): Alarm[] =>
    Array.from({ length: count }, (_, at) =>
      alarm(`a${at}`, { tag_id: String(at), reason: STRESSED }),
    );

  test('only if enabled: a sample at once, then at most one sound in ten seconds', async () => {
    const audio = new Audio(true);
    stubAudio(audio);
    const at = Math.ceil(performance.now()); // otherwise ten seconds later rounds to slightly less
    const clock = vi.spyOn(performance, 'now').mockReturnValue(at);
    vi.spyOn(Date, 'now').mockReturnValue(1_800_000_000_000);
    start(startSound);
    reportAlarms(...many(1));
    expect(audio.notes).toBe(0);
    await setSound(true);
    expect(soundState.get()).toBe('ready');
    expect(audio.notes).toBe(2);
    clock.mockReturnValue(at + QUIET_MS - 1);
    reportAlarms(...many(2));
    expect(audio.notes).toBe(2);
    clock.mockReturnValue(at + QUIET_MS);
    reportAlarms(...many(3));
    expect(audio.notes).toBe(4);
    clock.mockReturnValue(at + 2 * QUIET_MS);
    reportAlarms(cold, ...many(3));
    expect(audio.notes).toBe(8);
    clock.mockReturnValue(at + 3 * QUIET_MS);
    await setSound(false);
    reportAlarms(...many(4));
    expect(audio.notes).toBe(8);
  });

  test('enabled on an earlier visit, it waits for a click, and says so', async () => {
    const audio = new Audio(false);
    prefer({ sound: true });
    stubAudio(audio);
    start(startSound);
    expect(soundState.get()).toBe('waits');
    document.dispatchEvent(new Event('pointerup'));
    await vi.waitFor(() => {
      expect(soundState.get()).toBe('waits');
    });
    audio.resume = () => {
      audio.state = 'running';
      return Promise.resolve();
    };
    document.dispatchEvent(new Event('keyup'));
    await vi.waitFor(() => {
      expect(soundState.get()).toBe('ready');
    });
    reportAlarms(warm);
    expect(audio.notes).toBe(2);
  });

  test('a browser that cannot says so', async () => {
    start();
    // jsdom has no sound.
    await setSound(true);
    expect(soundState.get()).toBe('none');
    soundState.set('waits');
  });
});

describe('notification', () => {
  const shown: { title: string; body: string; onclick?: () => void; close: () => void }[] = [];
  /** Stand-in for the browser's Notification, which jsdom lacks. */
  const browser = (permission: string, answer = permission): { requests: number } => {
    const log = { requests: 0 };
    class Shown {
      static permission = permission;
      static requestPermission(): Promise<string> {
        log.requests += 1;
        Shown.permission = answer;
        return Promise.resolve(answer);
      }
      onclick?: () => void;
      body: string;
      constructor(
        readonly title: string,
        { body }: { body: string },
      ) {
        this.body = body;
        shown.push(this);
      }
      close(): void {
        shown.length = 0;
      }
    }
    vi.stubGlobal('Notification', Shown);
    vi.stubGlobal('isSecureContext', true);
    return log;
  };
  beforeEach(() => {
    shown.length = 0;
    vi.spyOn(document, 'hasFocus').mockReturnValue(false);
  });

  test('permission is requested by a click alone; one notification for all new alarms', async () => {
    const log = browser('default', 'granted');
    start(startNotify);
    reportAlarms(warm);
    expect([log.requests, shown.length]).toEqual([0, 0]);
    await setNotify(true);
    expect([log.requests, store.get().settings.notify, notifyState.get()]).toEqual([
      1,
      true,
      'granted',
    ]);
    reportAlarms(cold, warm, alarm('other', { tag_id: '3' }));
    expect(shown.map(({ title }) => title)).toEqual(['2 new alarms']);
    expect(shown[0]?.body).toMatch(/^New: Tag 1: .*; Tag 3: /);
    shown[0]?.onclick?.();
    expect(store.get().view.selected).toBe('1');
    expect(shown).toEqual([]);
  });

  test('what comes later takes its place', async () => {
    browser('granted');
    start(startNotify);
    await setNotify(true);
    reportAlarms();
    reportAlarms(warm);
    reportAlarms(warm, cold);
    expect(shown.map(({ title }) => title)).toEqual(['1 new alarm']);
  });

  test('of an alarm that the bridge pushes too, the page and the push show one notification', async () => {
    browser('granted');
    start(startNotify);
    await setNotify(true);
    isPushed.set(true);
    const showNotification = vi.fn();
    const getRegistration = () => Promise.resolve({ showNotification });
    vi.stubGlobal('navigator', { serviceWorker: { getRegistration } });
    reportAlarms();
    reportAlarms(cold);
    await vi.waitFor(() => {
      expect(showNotification).toHaveBeenCalledOnce();
    });
    const { tag, renotify } = showNotification.mock.lastCall?.[1] as Record<string, unknown>;
    expect(pushes).toContain(`tag: '${String(tag)}', renotify: ${String(renotify)}`);
    expect(shown).toEqual([]);
    isPushed.set(false);
  });

  test('not while the page is in use', async () => {
    browser('granted');
    start(startNotify);
    await setNotify(true);
    vi.spyOn(document, 'hasFocus').mockReturnValue(true);
    reportAlarms(warm);
    expect(shown).toEqual([]);
  });

  test('refused, not secure, or not to be had: it stays off and is said', async () => {
    browser('default', 'denied');
    start(startNotify);
    await setNotify(true);
    expect([store.get().settings.notify, notifyState.get()]).toEqual([false, 'refused']);
    vi.stubGlobal('isSecureContext', false);
    await setNotify(true);
    expect([store.get().settings.notify, notifyState.get()]).toEqual([false, 'insecure']);
  });

  test('a phone shows it by the service worker; a browser that cannot at all is reported', async () => {
    browser('granted');
    start(startNotify);
    await setNotify(true);
    const Failing = Object.assign(
      function fail() {
        throw new TypeError('Illegal constructor');
      },
      { permission: 'granted' },
    );
    vi.stubGlobal('Notification', Failing);
    const showNotification = vi.fn();
    const getRegistration = () => Promise.resolve({ showNotification });
    vi.stubGlobal('navigator', { serviceWorker: { getRegistration } });
    reportAlarms(warm);
    await vi.waitFor(() => {
      expect(showNotification.mock.lastCall?.[0]).toBe('1 new alarm');
    });
    expect([store.get().settings.notify, notifyState.get()]).toEqual([true, 'granted']);
    vi.stubGlobal('navigator', {});
    reportAlarms(warm, cold);
    await vi.waitFor(() => {
      expect([store.get().settings.notify, notifyState.get()]).toEqual([false, 'none']);
    });
  });
});
