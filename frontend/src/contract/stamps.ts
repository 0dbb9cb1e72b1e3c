/** Stamps are ROS seconds in the page: whatever arrives passes `inSeconds`. */
import type { components } from './openapi.gen';

type Stamp = components['schemas']['Time'];

/** A type of the wire with numbers for its stamps. */
export type InSeconds<Wire> = Wire extends Stamp
  ? number
  : { [Key in keyof Wire]: InSeconds<Wire[Key]> };

/** Replaces each stamp within a received value. */
export function inSeconds(value: unknown): unknown {
  if (typeof value !== 'object' || value === null) return value;
  const { sec, nanosec } = value as Partial<Stamp>;
  if (typeof sec === 'number' && typeof nanosec === 'number') return sec + nanosec / 1e9;
  const parts = value as Record<string, unknown>;
  for (const key of Object.keys(parts)) {
    const part = parts[key];
    if (typeof part === 'object') parts[key] = inSeconds(part);
  }
  return value;
}
