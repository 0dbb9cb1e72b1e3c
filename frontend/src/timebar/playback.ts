/**
 * Plays the past: the moment goes on by a clock of its own, whatever has come of it by then. What
 * comes too late is dropped, so that it never lags. It ends in now.
 */
import { now } from '../clock';
import { act, store } from '../store/app';
import { createStore } from '../store/create';
import { barSpan, twinNow } from '../store/moment';

/** Seconds of the past a second. */
export const SPEEDS = [60, 300, 900, 3_600] as const;
type Speed = (typeof SPEEDS)[number];

const TICK_MS = 100;

export const playback = createStore<{ isPlaying: boolean; speed: Speed }>({
  isPlaying: false,
  speed: 300,
});

let timer: ReturnType<typeof setInterval> | undefined;
let unsubscribe: () => void = () => undefined;
/** The moment that was last played, ROS seconds, and when that was, ms. */
let at = 0;
let since = 0;

export function pause(): void {
  clearInterval(timer);
  unsubscribe();
  if (playback.get().isPlaying) playback.set({ ...playback.get(), isPlaying: false });
}

/** From the moment that is shown; from now, from the beginning of the bar. */
export function play(): void {
  const nowS = twinNow();
  if (nowS === null) return;
  pause();
  const state = store.get();
  go(state.view.moment ?? barSpan(state, nowS).from);
  playback.set({ ...playback.get(), isPlaying: true });
  timer = setInterval(tick, TICK_MS);
  // Whoever takes the moment elsewhere has taken over.
  unsubscribe = store.subscribe(() => {
    const { moment } = store.get().view;
    if (moment === null || Math.abs(moment - at) > 0.001) pause();
  });
}

export function togglePlayback(): void {
  if (playback.get().isPlaying) pause();
  else play();
}

export function chooseSpeed(speed: Speed): void {
  playback.set({ ...playback.get(), speed });
}

function go(moment: number): void {
  at = moment;
  since = now();
  act({ moment });
}

function tick(): void {
  const nowS = twinNow();
  const next = at + ((now() - since) / 1000) * playback.get().speed;
  if (nowS === null || store.get().twin.pastFault?.isLasting) {
    pause();
  } else if (next >= nowS) {
    pause();
    act({ moment: null });
  } else {
    go(next);
  }
}
