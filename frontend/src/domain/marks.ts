/**
 * The shape of a verdict: one outline and one sign each, the same on the map, in the table and in the
 * legend. Outlines differ as silhouettes, so that even pins of a few pixels are distinguishable without
 * colour. SVG paths about the origin, y down; most of an outline is at radius 1.
 */
import type { Verdict } from '../contract/types';
import { S } from '../strings';
import type { Rgb } from './ramp';
import { shown } from './text';

interface Mark {
  readonly outline: string;
  /** The sign on it; a dot is a line of almost no length. Empty: nothing is known. */
  readonly sign: string;
}

const CIRCLE = 'M-1 0A1 1 0 1 1 1 0A1 1 0 1 1-1 0Z';

export const MARKS: Readonly<Record<Verdict, Mark>> = {
  critical: { outline: 'M-.92-.92H.92V.92H-.92Z', sign: 'M-.42-.42L.42.42M.42-.42L-.42.42' },
  stressed: { outline: 'M0-1.08L1.14.9H-1.14Z', sign: 'M0-.34V.24M0 .6V.61' },
  unknown: { outline: CIRCLE, sign: '' },
  healthy: { outline: CIRCLE, sign: 'M-.44.04L-.12.36L.46-.3' },
};

/** How a species' blooms are drawn: by colour and shape, never by colour alone. */
export interface BloomLook {
  readonly colour: Rgb;
  readonly shape: 'circle' | 'square' | 'triangle';
}

/**
 * Colours: Okabe and Ito, "Color Universal Design" (2008), distinguishable with every common colour
 * blindness; without their black, which would vanish on a dark map. Neighbours in this list have
 * different shapes, and so do the two colours closest for red-green blindness.
 */
const LOOKS: readonly BloomLook[] = [
  { colour: [0, 114, 178], shape: 'circle' },
  { colour: [230, 159, 0], shape: 'square' },
  { colour: [204, 121, 167], shape: 'triangle' },
  { colour: [240, 228, 66], shape: 'circle' },
  { colour: [86, 180, 233], shape: 'square' },
  { colour: [213, 94, 0], shape: 'triangle' },
  { colour: [0, 158, 115], shape: 'circle' },
];

export const UNKNOWN_SPECIES: BloomLook = { colour: [140, 140, 140], shape: 'circle' };

/**
 * A style for each species name. It is derived from the name, so that a species keeps it from day to
 * day. If two collide, the later in the alphabet takes the next free one. With more species than
 * styles, styles repeat.
 */
export function speciesLooks(names: Iterable<string>): ReadonlyMap<string, BloomLook> {
  const looks = new Map<string, BloomLook>();
  const taken = new Set<number>();
  for (const name of [...new Set(names)].sort()) {
    if (name === '') continue;
    let index = hash(name) % LOOKS.length;
    while (taken.has(index) && taken.size < LOOKS.length) index = (index + 1) % LOOKS.length;
    taken.add(index);
    looks.set(name, LOOKS[index] ?? UNKNOWN_SPECIES);
  }
  return looks;
}

/** FNV-1a, 32 bit. */
function hash(text: string): number {
  let value = 0x811c9dc5;
  for (let i = 0; i < text.length; i++) {
    value = Math.imul(value ^ text.charCodeAt(i), 0x01000193);
  }
  return value >>> 0;
}

/** A species in the reader's language, safe to show; without a translation, as received, with a capital. */
export function speciesText(name: string, longest?: number): string {
  const names: Readonly<Record<string, string>> = S.speciesNames;
  const known = name.toLowerCase();
  const own = (Object.hasOwn(names, known) ? names[known] : undefined) ?? name;
  return shown(own.charAt(0).toUpperCase() + own.slice(1), longest);
}
