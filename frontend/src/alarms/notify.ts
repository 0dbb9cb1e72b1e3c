/** Alarms while nobody looks at the page: opt-in notifications and sounds, and the page's icon. */
import { now } from '../clock';
import { request } from '../contract/api';
import { postPush } from '../contract/people';
import type { Verdict } from '../contract/types';
import { onChange, prefer, store } from '../store/app';
import { createStore, PAGE } from '../store/create';
import { selectOrigin } from '../store/moment';
import { S } from '../strings';
import { showAlarm } from './follow';
import type { Item } from './list';
import { severalNow, worstNow } from './latest';
import { alarmList, onNews } from './watch';

/**
 * The browser's permission. "prompt": it will ask the operator. "insecure": it allows notifications only
 * on https or localhost. "none": it has none, or does not let a page show them.
 */
export type NotifyState = 'granted' | 'prompt' | 'refused' | 'insecure' | 'none';

function stateNow(): NotifyState {
  if (!window.isSecureContext) return 'insecure';
  if (!('Notification' in window)) return 'none';
  const { permission } = Notification;
  return permission === 'granted' ? 'granted' : permission === 'denied' ? 'refused' : 'prompt';
}

export const notifyState = createStore<NotifyState>('none');

/** Whether the bridge reaches this browser while the page is closed, by Web Push. */
export const isPushed = createStore(false);

/** Turns notifications on or off, on a click: only then may the page ask for permission. */
export async function setNotify(isRequested: boolean): Promise<void> {
  notifyState.set(stateNow());
  if (isRequested && notifyState.get() === 'prompt') {
    await Notification.requestPermission();
    notifyState.set(stateNow());
  }
  const isOn = isRequested && notifyState.get() === 'granted';
  prefer({ notify: isOn });
  await tryPush(isOn);
}

/** In addition: without a push service, or if the bridge is unreachable, an open page still notifies. */
async function tryPush(isRequested: boolean): Promise<void> {
  isPushed.set(await setPush(isRequested).catch(() => false));
}

let last: Notification | null = null;

/** Shows one notification for all new alarms, shared by all tabs; a later one replaces it. */
async function show(raised: readonly Item[]): Promise<void> {
  const [first] = raised;
  if (!first) return;
  const body = severalNow(store.get(), raised, S.alarmsRaised);
  const origin = selectOrigin(store.get());
  const several = S.alarmNotifyTitle(raised.length);
  const title = origin === null ? several : `${S.origin[origin]}: ${several}`;
  // The tag of the bridge's pushes in `sw.js`: of the same alarm, the later one takes the earlier one's place.
  const options = { body, tag: 'lupin-twin.alarms', renotify: true };
  // Only one that the service worker shows, too, has its place taken.
  if (isPushed.get() && (await showByWorker(title, options))) return;
  try {
    // Browsers replace the same tag silently.
    last?.close();
    const shown = new Notification(title, options);
    last = shown;
    shown.onclick = () => {
      window.focus();
      showAlarm(first.alarm);
      shown.close();
    };
  } catch {
    // Phones leave this to the service worker, and throw only here.
    if (await showByWorker(title, options)) return;
    notifyState.set('none');
    prefer({ notify: false });
  }
}

async function showByWorker(title: string, options: NotificationOptions): Promise<boolean> {
  const worker = await registration().catch(() => undefined);
  await worker?.showNotification(title, options);
  return worker !== undefined;
}

/** Notifies of new alarms if enabled and the page is not in use. */
export function startNotify(signal = PAGE): void {
  notifyState.set(stateNow());
  // Anew on each visit: the browser, its push service or the bridge may have forgotten it.
  if (store.get().settings.notify && notifyState.get() === 'granted') void tryPush(true);
  onNews(({ raised }) => {
    notifyState.set(stateNow());
    const isLooking = document.visibilityState === 'visible' && document.hasFocus();
    if (store.get().settings.notify && notifyState.get() === 'granted' && !isLooking)
      void show(raised);
  }, signal);
}

interface Key {
  public_key: string | null;
}

const registration = async (): Promise<ServiceWorkerRegistration | undefined> =>
  'serviceWorker' in navigator ? navigator.serviceWorker.getRegistration() : undefined;

/**
 * Subscribes this browser to the bridge's Web Push, or unsubscribes it; without Web Push, does nothing.
 * Returns whether it is subscribed.
 */
export async function setPush(isRequested: boolean): Promise<boolean> {
  const worker = await registration();
  if (!worker || !('pushManager' in worker)) return false;
  const { pushManager } = worker;
  const known = await pushManager.getSubscription();
  if (!isRequested) {
    if (!known) return false;
    // First, as it needs no bridge: the bridge forgets a browser that its push service does not know.
    await known.unsubscribe();
    await postPush({ endpoint: known.endpoint });
    return false;
  }
  const { public_key: key } = (await (await request('api/push', {})).json()) as Key;
  if (key === null) return false;
  const options = { userVisibleOnly: true, applicationServerKey: key };
  let subscription;
  try {
    subscription = await pushManager.subscribe(options);
  } catch (error) {
    // An existing subscription has another key, from an earlier bridge at this address.
    if (!known) throw error;
    await known.unsubscribe();
    subscription = await pushManager.subscribe(options);
  }
  await postPush(subscription.toJSON());
  return true;
}

/** White text on these colours is legible on any tab bar, which does not follow our theme. */
const COLOURS = { critical: '#b3261e', other: '#855300' } as const;

/** The favicon as a data URL: number of active alarms and the worst verdict; null: no alarms, plain icon. */
export function badgeOf(count: number, worst: Verdict): string | null {
  if (count === 0) return null;
  const text = count > 9 ? '9+' : String(count);
  const colour = worst === 'critical' ? COLOURS.critical : COLOURS.other;
  // Critical has corners, like its mark on the page, so that it reads without colour.
  const shape =
    worst === 'critical'
      ? '<path d="M9.500 1h13L31 9.500v13L22.500 31h-13L1 22.500v-13Z"'
      : '<circle cx="16" cy="16" r="15"';
  const svg =
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 32 32">' +
    `${shape} fill="${colour}"/>` +
    '<text x="16" y="23" text-anchor="middle" font-family="sans-serif" font-weight="700" ' +
    `font-size="${text.length > 1 ? 17 : 21}" fill="#fff">${text}</text></svg>`;
  return `data:image/svg+xml,${encodeURIComponent(svg)}`;
}

/** Keeps the favicon up to date. */
export function startBadge(signal = PAGE): void {
  const link = document.querySelector<HTMLLinkElement>('link[rel=icon]');
  if (!link) return;
  const plain = link.getAttribute('href') ?? '';
  const update = (): void => {
    const items = alarmList.get().active;
    const href = badgeOf(items.length, worstNow(store.get(), items) ?? 'unknown') ?? plain;
    if (link.getAttribute('href') !== href) link.setAttribute('href', href);
  };
  update();
  alarmList.subscribe(update, signal);
  onChange((state) => [worstNow(state, alarmList.get().active)], update, signal);
}

/** Least time between two sounds, ms. */
export const QUIET_MS = 10_000;

/**
 * "waits": the browser blocks sound until the user has clicked in the page. "none": it has no Web
 * Audio.
 */
export type SoundState = 'ready' | 'waits' | 'none';

export const soundState = createStore<SoundState>('waits');

/** Note sequences for a critical and any other alarm, Hz. */
const NOTES = { critical: [880, 660, 880, 660], other: [660, 880] } as const;
const NOTE_S = 0.14;
/** Loud enough across a room, far below the maximum of 1. */
const GAIN = 0.25;

/** Plays notes, faded in and out to avoid clicks. */
export function play(context: AudioContext, notes: readonly number[]): void {
  for (const [index, hz] of notes.entries()) {
    const begin = context.currentTime + index * NOTE_S;
    const tone = context.createOscillator();
    const gain = context.createGain();
    tone.frequency.value = hz;
    gain.gain.setValueAtTime(0, begin);
    gain.gain.linearRampToValueAtTime(GAIN, begin + 0.02);
    gain.gain.linearRampToValueAtTime(0, begin + NOTE_S);
    tone.connect(gain).connect(context.destination);
    tone.start(begin);
    tone.stop(begin + NOTE_S);
  }
}

let context: AudioContext | null = null;
let playedAt = -Infinity;

/** Creates or resumes the audio context; the browser allows it only within a user gesture. */
async function wake(): Promise<void> {
  try {
    context ??= new AudioContext();
  } catch {
    soundState.set('none');
    return;
  }
  await context.resume().catch(() => undefined);
  soundState.set(context.state === 'running' ? 'ready' : 'waits');
}

function sound(notes: readonly number[]): void {
  const at = now();
  if (context?.state !== 'running' || at - playedAt < QUIET_MS) return;
  playedAt = at;
  play(context, notes);
}

/** Turns sound on or off, on a click; plays a sample at once when turned on. */
export async function setSound(isRequested: boolean): Promise<void> {
  prefer({ sound: isRequested });
  if (!isRequested) return;
  await wake();
  playedAt = -Infinity;
  sound(NOTES.other);
}

/** Plays a sound for new alarms if enabled. */
export function startSound(signal = PAGE): void {
  // Enabled on an earlier visit: the first click or key unlocks the sound.
  const onGesture = (): void => {
    if (store.get().settings.sound && context?.state !== 'running') void wake();
  };
  document.addEventListener('pointerup', onGesture, { signal });
  document.addEventListener('keyup', onGesture, { signal });
  onNews(({ raised }) => {
    if (raised.length === 0 || !store.get().settings.sound) return;
    const isCritical = raised.some(({ alarm }) => alarm.reason.verdict === 'critical');
    sound(NOTES[isCritical ? 'critical' : 'other']);
  }, signal);
  signal.addEventListener('abort', () => {
    void context?.close().catch(() => undefined);
    context = null;
    playedAt = -Infinity;
    soundState.set('waits');
  });
}
