import { render, screen } from '@testing-library/react';
import { afterEach, expect, test, vi } from 'vitest';

import { prefer } from '../store/app';
import { NotifySettings } from '../ui/alarms/AlarmNotes';
import { isPushed, setNotify, setPush, startNotify } from './notify';
import { started } from '../testing/life';

afterEach(() => {
  vi.unstubAllGlobals();
  prefer({ notify: false });
});

/** Sets up a browser with a service worker and a bridge with this key; returns the log of calls. */
function stage(key: string | null, { known = false, fails = false } = {}): unknown[] {
  const log: unknown[] = [];
  const subscription = {
    endpoint: 'https://push.example/1',
    toJSON: () => ({ endpoint: 'https://push.example/1', keys: { p256dh: 'p', auth: 'a' } }),
    unsubscribe: () => Promise.resolve(log.push('unsubscribe')),
  };
  let isFailing = fails;
  const pushManager = {
    getSubscription: () => Promise.resolve(known ? subscription : null),
    subscribe: (options: unknown) => {
      log.push(options);
      if (!isFailing) return Promise.resolve(subscription);
      isFailing = false;
      return Promise.reject(new Error('another key'));
    },
  };
  const getRegistration = () => Promise.resolve({ pushManager });
  vi.stubGlobal('navigator', { serviceWorker: { getRegistration } });
  vi.stubGlobal('fetch', (_path: string, init?: RequestInit) => {
    if (init?.body) log.push(JSON.parse(init.body as string));
    return Promise.resolve({ ok: true, json: () => Promise.resolve({ public_key: key }) });
  });
  return log;
}

const options = { userVisibleOnly: true, applicationServerKey: 'KEY' };
const subscribed = { endpoint: 'https://push.example/1', keys: { p256dh: 'p', auth: 'a' } };

test('a browser subscribes with the key of its bridge, which gets the subscription', async () => {
  const log = stage('KEY');
  await setPush(true);
  expect(log).toEqual([options, subscribed]);
});

test('each visit subscribes anew: the push service may have ended the subscription meanwhile', async () => {
  const log = stage('KEY');
  vi.stubGlobal('Notification', { permission: 'granted' });
  vi.stubGlobal('isSecureContext', true);
  prefer({ notify: true });
  started(startNotify)();
  render(<NotifySettings />);
  // A grower who relies on the phone learns whether the bridge reaches it.
  screen.getByText(/while this page is open in the background\.$/);
  await screen.findByText(/Critical alarms also arrive while it is closed\.$/);
  expect(log).toEqual([options, subscribed]);
  await setNotify(false);
  expect(isPushed.get()).toBe(false);
});

test('one of another key gives way', async () => {
  const log = stage('KEY', { known: true, fails: true });
  await setPush(true);
  expect(log).toEqual([options, 'unsubscribe', options, subscribed]);
});

test('turned off, it is unsubscribed at the browser and the bridge', async () => {
  const log = stage('KEY', { known: true });
  await setPush(false);
  // The browser first: even if the bridge is unreachable, nothing comes any more.
  expect(log).toEqual(['unsubscribe', { endpoint: 'https://push.example/1' }]);
});

test('without Web Push at the bridge, the browser is not subscribed', async () => {
  const log = stage(null);
  expect(await setPush(true)).toBe(false);
  vi.stubGlobal('navigator', {});
  expect(await setPush(true)).toBe(false);
  expect(log).toEqual([]);
});
