/** A short sound for new alarms, made by the browser itself; only on wish. */
import { now } from '../clock';
import { createStore } from '../store/create';
import { own, preferTold } from './own';
import { onNews } from './watch';

/** At most one in so long, ms. */
export const QUIET_MS = 10_000;

/**
 * "waits": the browser lets no page be heard before somebody has clicked in it. "none": it cannot
 * make a sound.
 */
export type SoundState = 'ready' | 'waits' | 'none';

export const soundState = createStore<SoundState, SoundState>('waits', (_, next) => next);

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
    soundState.dispatch('none');
    return;
  }
  await context.resume().catch(() => undefined);
  soundState.dispatch(context.state === 'running' ? 'ready' : 'waits');
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
    soundState.dispatch('waits');
  };
}
