/**
 * Plays the past. The moment follows its own clock and never waits for data: late answers are dropped.
 * Playback ends at now.
 */
import { now } from '../clock';
import { act, store } from '../store/app';
import { createStore } from '../store/create';
import { barSpan, twinNow } from '../store/moment';

/** Past seconds per second. */
export const SPEEDS = [60, 300, 900, 3_600] as const;
type Speed = (typeof SPEEDS)[number];

const TICK_MS = 100;

export const playback = createStore<{ isPlaying: boolean; speed: Speed }>({
  isPlaying: false,
  speed: 300,
});

let timer: ReturnType<typeof setInterval> | undefined;
let playing = new AbortController();
/** The last played moment, ROS seconds, and when it was played, ms. */
let at = 0;
let since = 0;

export function pause(): void {
  clearInterval(timer);
  playing.abort();
  if (playback.get().isPlaying) playback.set({ ...playback.get(), isPlaying: false });
}

/** Plays from the shown moment; if live, from the start of the bar. */
export function play(): void {
  const nowS = twinNow();
  if (nowS === null) return;
  pause();
  const state = store.get();
  go(state.view.moment ?? barSpan(state, nowS).from);
  playback.set({ ...playback.get(), isPlaying: true });
  timer = setInterval(tick, TICK_MS);
  playing = new AbortController();
  // Any other change of the moment stops playback.
  store.subscribe(() => {
    const { moment } = store.get().view;
    if (moment === null || Math.abs(moment - at) > 0.001) pause();
  }, playing.signal);
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
