/** What comes over the WebSocket, checked to the last field: nothing behind it checks again. */
import { checkOf, isObject } from './check';
import { filledHealth, filledTag } from './filled';
import type { Frame } from './types';

/** Most characters of a frame: the largest house that a twin keeps is a bit smaller. */
export const MAX_FRAME_CHARS = 128_000_000;

const FRAMES: Readonly<Record<Frame['type'], string>> = {
  status: 'StatusFrame',
  state: 'StateFrame',
  delta: 'DeltaFrame',
  alarms: 'AlarmsFrame',
  robot: 'RobotFrame',
};

/** "passed over": a type of a later server. */
export type Parsed =
  | { readonly kind: 'frame'; readonly frame: Frame }
  | { readonly kind: 'passed over' }
  | { readonly kind: 'bad'; readonly why: string; readonly isDelta: boolean };

const bad = (why: string, isDelta = false): Parsed => ({ kind: 'bad', why, isDelta });

/** Reads one WebSocket message. */
export function parseFrame(data: unknown): Parsed {
  if (typeof data !== 'string') return bad('a message that is no text');
  if (data.length > MAX_FRAME_CHARS) {
    return bad(`a frame of ${data.length} characters, the limit is ${MAX_FRAME_CHARS}`);
  }
  let message: unknown;
  try {
    message = JSON.parse(data);
  } catch {
    return bad('a message that is no JSON');
  }
  if (!isObject(message) || typeof message['type'] !== 'string') return bad('a frame without type');
  const { type } = message;
  if (!isKnown(type)) return { kind: 'passed over' };
  const why = checkOf(FRAMES[type])(message);
  if (why !== null) return bad(type + why, type === 'delta');
  return { kind: 'frame', frame: filled(message as unknown as Frame) };
}

function filled(frame: Frame): Frame {
  switch (frame.type) {
    case 'state': {
      const state = { ...frame.state, tags: frame.state.tags.map(filledTag) };
      return { ...frame, state, health: filledHealth(frame.health) };
    }
    case 'delta': {
      const changed = frame.changed.map(filledTag);
      return { ...frame, changed, health: filledHealth(frame.health) };
    }
    case 'status':
    case 'alarms':
    case 'robot':
      return frame;
  }
}

const isKnown = (type: string): type is Frame['type'] => Object.hasOwn(FRAMES, type);
