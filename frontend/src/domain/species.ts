import type { Rgb } from './ramp';

/**
 * Okabe and Ito, "Color Universal Design" (2008): told apart with every common kind of colour
 * blindness. Their black is left out, as it is no colour on a dark map.
 */
const PALETTE: readonly Rgb[] = [
  [0, 114, 178],
  [230, 159, 0],
  [204, 121, 167],
  [240, 228, 66],
  [86, 180, 233],
  [213, 94, 0],
  [0, 158, 115],
];
export const UNKNOWN_SPECIES: Rgb = [140, 140, 140];

/**
 * A colour for each species name. It starts from the name itself, so that a species keeps its
 * colour from one day to the next; where two want the same, the later in the alphabet takes the
 * next free one. Beyond the palette's size colours repeat.
 */
export function speciesColours(names: Iterable<string>): ReadonlyMap<string, Rgb> {
  const colours = new Map<string, Rgb>();
  const taken = new Set<number>();
  for (const name of [...new Set(names)].sort()) {
    if (name === '') continue;
    let index = hash(name) % PALETTE.length;
    while (taken.has(index) && taken.size < PALETTE.length) index = (index + 1) % PALETTE.length;
    taken.add(index);
    colours.set(name, PALETTE[index] ?? UNKNOWN_SPECIES);
  }
  return colours;
}

/** FNV-1a, 32 bit. */
function hash(text: string): number {
  let value = 0x811c9dc5;
  for (let i = 0; i < text.length; i++) {
    value = Math.imul(value ^ text.charCodeAt(i), 0x01000193);
  }
  return value >>> 0;
}
