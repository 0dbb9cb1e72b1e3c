import type { Frame } from './types';

/**
 * Reads one WebSocket message. Returns null for anything that is not a frame of the contract:
 * a page that runs for months must outlive one bad message, and a frame type added later.
 * Deeper fields are not checked here; `domain/twin` reads them defensively.
 */
export function parseFrame(text: string): Frame | null {
  let message: unknown;
  try {
    message = JSON.parse(text);
  } catch {
    return null;
  }
  if (!isObject(message)) return null;
  if (message['type'] === 'status' && typeof message['twin'] === 'string') {
    return message as unknown as Frame;
  }
  if (
    message['type'] === 'state' &&
    typeof message['revision'] === 'string' &&
    isObject(message['state']) &&
    Array.isArray(message['state']['tags'])
  ) {
    return message as unknown as Frame;
  }
  if (
    message['type'] === 'delta' &&
    typeof message['revision'] === 'string' &&
    typeof message['base'] === 'number' &&
    isObject(message['header']) &&
    Array.isArray(message['changed']) &&
    Array.isArray(message['removed'])
  ) {
    return message as unknown as Frame;
  }
  return null;
}

function isObject(value: unknown): value is Record<string, unknown> {
  return typeof value === 'object' && value !== null;
}
