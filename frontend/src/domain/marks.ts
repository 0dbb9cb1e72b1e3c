/**
 * The look of a verdict without its colour: one outline and one sign each, the same on the map, in
 * the table and in the legend. Outlines differ as silhouettes, so that a pin of a few pixels is told
 * by whoever sees no colours. SVG paths about the origin, y down; most of an outline is at radius 1.
 */
import type { Verdict } from '../contract/types';
import { S } from '../strings';
import type { Rgb } from './ramp';
import { shown } from './text';

interface Mark {
  readonly outline: string;
  /** What is drawn on it; a dot is a line of next to no length. Empty: nothing is known. */
  readonly sign: string;
}

const CIRCLE = 'M-1 0A1 1 0 1 1 1 0A1 1 0 1 1-1 0Z';

export const MARKS: Readonly<Record<Verdict, Mark>> = {
  critical: { outline: 'M-.92-.92H.92V.92H-.92Z', sign: 'M-.42-.42L.42.42M.42-.42L-.42.42' },
  stressed: { outline: 'M0-1.08L1.14.9H-1.14Z', sign: 'M0-.34V.24M0 .6V.61' },
  unknown: { outline: CIRCLE, sign: '' },
  healthy: { outline: CIRCLE, sign: 'M-.44.04L-.12.36L.46-.3' },
};

/** How a species' blooms are drawn: colour and shape, so that colour is never alone. */
export interface BloomLook {
  readonly colour: Rgb;
  readonly shape: 'circle' | 'square' | 'triangle';
}

/**
 * Colours: Okabe and Ito, "Color Universal Design" (2008), told apart with every common kind of
 * colour blindness; their black is left out, as it is none on a dark map. Neighbours in this list
 * have different shapes, and so have the two colours that come closest for red-green blindness.
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
 * A look for each species name. It starts from the name itself, so that a species keeps its look
 * from one day to the next; where two want the same, the later in the alphabet takes the next
 * free one. Beyond the list's size looks repeat.
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

/** A species in the reader's language, fit to show; one that the page has no name for, as it came. */
export function speciesText(name: string, longest?: number): string {
  const names: Readonly<Record<string, string>> = S.speciesNames;
  const known = name.toLowerCase();
  return shown((Object.hasOwn(names, known) ? names[known] : undefined) ?? name, longest);
}
