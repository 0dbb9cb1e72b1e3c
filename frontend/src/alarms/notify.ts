/** For who looks at something else: notifications and sounds on wish, and the page's icon. */
import { now } from '../clock';
import { ask } from '../contract/api';
import { postPush } from '../contract/people';
import type { Verdict } from '../contract/types';
import { store } from '../store/app';
import { createStore } from '../store/create';
import { selectOrigin } from '../store/moment';
import { S } from '../strings';
import { showAlarm } from './follow';
import type { Item } from './list';
import { own, preferTold } from './own';
import { textNow } from './speech';
import { alarmList, onNews } from './watch';
import { severalText } from './words';

/**
 * What the browser says to it. "asks": it will ask the operator. "insecure": it allows them only on
 * https or localhost. "none": it has none, or only such as a page cannot make by itself.
 */
export type NotifyState = 'granted' | 'asks' | 'refused' | 'insecure' | 'none';

function stateNow(): NotifyState {
  if (!window.isSecureContext) return 'insecure';
  if (!('Notification' in window)) return 'none';
  const { permission } = Notification;
  return permission === 'granted' ? 'granted' : permission === 'denied' ? 'refused' : 'asks';
}

export const notifyState = createStore<NotifyState>('none');

/** The operator's wish, told by a click: only then the browser is asked. */
export async function wishNotify(isWished: boolean): Promise<void> {
  notifyState.set(stateNow());
  if (isWished && notifyState.get() === 'asks') {
    await Notification.requestPermission();
    notifyState.set(stateNow());
  }
  const isOn = isWished && notifyState.get() === 'granted';
  preferTold({ notify: isOn });
  // Beside it: the page notifies by itself while it is open.
  await wishPush(isOn).catch(() => {
    // No push service, or a bridge that is gone meanwhile: the page still notifies.
  });
}

let last: Notification | null = null;

/** One for all that is new, in whichever tabs of the browser; a later one takes its place. */
function show(raised: readonly Item[]): void {
  const [first] = raised;
  if (!first) return;
  const body = severalText(
    raised.map(({ alarm }) => alarm),
    (alarm) => textNow(store.get(), alarm),
    S.alarmsRaised,
  );
  try {
    const origin = selectOrigin(store.get());
    const title = S.alarmNotifyTitle(raised.length);
    last?.close();
    const shown = new Notification(origin === null ? title : `${S.origin[origin]}: ${title}`, {
      body,
      // Other news has another name: under the same one a browser does so in silence.
      tag: `lupin-twin.alarms ${first.alarm.id} ${first.verdict}`,
    });
    last = shown;
    shown.onclick = () => {
      window.focus();
      showAlarm(first.alarm);
      shown.close();
    };
  } catch {
    // Some browsers let no page make them, and say so only now.
    notifyState.set('none');
    preferTold({ notify: false });
  }
}

/** Tells of what is new where that is wished and nobody looks; returns the way to stop. */
export function startNotify(): () => void {
  notifyState.set(stateNow());
  return onNews(({ raised }) => {
    notifyState.set(stateNow());
    const isLooking = document.visibilityState === 'visible' && document.hasFocus();
    if (own.get().notify && notifyState.get() === 'granted' && !isLooking) show(raised);
  });
}

interface Key {
  public_key: string | null;
}

/** Subscribes this browser at the bridge, or ends that. Harmless where there is no Web Push. */
export async function wishPush(isWished: boolean): Promise<void> {
  if (!('serviceWorker' in navigator)) return;
  const registration = await navigator.serviceWorker.getRegistration();
  if (!registration || !('pushManager' in registration)) return;
  const { pushManager } = registration;
  const known = await pushManager.getSubscription();
  if (!isWished) {
    if (!known) return;
    await postPush({ endpoint: known.endpoint });
    await known.unsubscribe();
    return;
  }
  const { public_key: key } = (await (await ask('api/push', {})).json()) as Key;
  if (key === null) return;
  const options = { userVisibleOnly: true, applicationServerKey: key };
  let subscription;
  try {
    subscription = await pushManager.subscribe(options);
  } catch (error) {
    // One with another key, of a bridge that was here before.
    if (!known) throw error;
    await known.unsubscribe();
    subscription = await pushManager.subscribe(options);
  }
  await postPush(subscription.toJSON());
}

/** The browser's bar of tabs follows no theme of ours: white on these is legible on any. */
const COLOURS = { critical: '#b3261e', other: '#855300' } as const;

/** The page's icon, which says how many alarms are active, and how bad the worst is; null: that without any. */
export function badgeOf(count: number, worst: Verdict): string | null {
  if (count === 0) return null;
  const text = count > 9 ? '9+' : String(count);
  const colour = worst === 'critical' ? COLOURS.critical : COLOURS.other;
  // Critical has corners, as its sign has in the page: told without colour.
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

/** Keeps the icon so; returns the way to stop. */
export function startBadge(): () => void {
  const link = document.querySelector<HTMLLinkElement>('link[rel=icon]');
  if (!link) return () => undefined;
  const plain = link.getAttribute('href') ?? '';
  const update = (): void => {
    const items = alarmList.get().active;
    const href = badgeOf(items.length, items[0]?.verdict ?? 'unknown') ?? plain;
    if (link.getAttribute('href') !== href) link.setAttribute('href', href);
  };
  update();
  return alarmList.subscribe(update);
}

/** At most one in so long, ms. */
export const QUIET_MS = 10_000;

/**
 * "waits": the browser lets no page be heard before somebody has clicked in it. "none": it cannot
 * make a sound.
 */
export type SoundState = 'ready' | 'waits' | 'none';

export const soundState = createStore<SoundState>('waits');

/** Notes of a critical alarm and of any other: Hz, one after the other. */
const NOTES = { critical: [880, 660, 880, 660], other: [660, 880] } as const;
const NOTE_S = 0.14;
/** Loud enough across a room, far from the loudest. */
const GAIN = 0.25;

/** Plays notes with soft ends, so that nothing clicks. */
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

/** Makes what sounds, or wakes it: within a click, or the browser refuses. */
async function wake(make: () => AudioContext): Promise<void> {
  try {
    context ??= make();
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

/** The operator's wish, told by a click: it is heard at once what it sounds like. */
export async function wishSound(
  isWished: boolean,
  make: () => AudioContext = () => new AudioContext(),
): Promise<void> {
  preferTold({ sound: isWished });
  if (!isWished) return;
  await wake(make);
  playedAt = -Infinity;
  sound(NOTES.other);
}

/** Sounds for what is new where that is wished; returns the way to stop. */
export function startSound(make: () => AudioContext = () => new AudioContext()): () => void {
  // Kept from another day: the first click or key lets it be heard.
  const onGesture = (): void => {
    if (own.get().sound && context?.state !== 'running') void wake(make);
  };
  document.addEventListener('pointerup', onGesture);
  document.addEventListener('keyup', onGesture);
  const stop = onNews(({ raised }) => {
    if (raised.length === 0 || !own.get().sound) return;
    const isCritical = raised.some(({ verdict }) => verdict === 'critical');
    sound(NOTES[isCritical ? 'critical' : 'other']);
  });
  return () => {
    stop();
    document.removeEventListener('pointerup', onGesture);
    document.removeEventListener('keyup', onGesture);
    void context?.close().catch(() => undefined);
    context = null;
    playedAt = -Infinity;
    soundState.set('waits');
  };
}
