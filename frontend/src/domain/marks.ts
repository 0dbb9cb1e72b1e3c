/**
 * The look of a verdict without its colour: one outline and one sign each, the same on the map, in
 * the table and in the legend. Outlines differ as silhouettes, so that a pin of a few pixels is told
 * by whoever sees no colours. About the origin, y down; most of an outline is at radius 1.
 */
import type { Verdict } from '../contract/types';
import { S } from '../strings';
import type { Rgb } from './ramp';
import { shown } from './text';

export type Point = readonly [number, number];

export interface Mark {
  /** A closed line; "circle": one of radius 1. */
  readonly outline: readonly Point[] | 'circle';
  /** What is drawn on it: open lines; a dot is a line of no length. */
  readonly sign: readonly (readonly Point[])[];
  /** Nothing is known: the outline alone. */
  readonly isHollow: boolean;
}

/** Its points as "x,y x,y". */
export const lineOf = (points: string): Point[] =>
  points.split(' ').map((point) => {
    const [x = 0, y = 0] = point.split(',').map(Number);
    return [x, y];
  });

export const MARKS: Readonly<Record<Verdict, Mark>> = {
  critical: {
    outline: lineOf('-.92,-.92 .92,-.92 .92,.92 -.92,.92'),
    sign: [lineOf('-.42,-.42 .42,.42'), lineOf('.42,-.42 -.42,.42')],
    isHollow: false,
  },
  stressed: {
    outline: lineOf('0,-1.08 1.14,.9 -1.14,.9'),
    sign: [lineOf('0,-.34 0,.24'), lineOf('0,.6 0,.61')],
    isHollow: false,
  },
  unknown: { outline: 'circle', sign: [], isHollow: true },
  healthy: { outline: 'circle', sign: [lineOf('-.44,.04 -.12,.36 .46,-.3')], isHollow: false },
};

/** The lines as an SVG path in the middle of a box of 16 by 16; `closed`: each ends where it began. */
export function svgPath(
  lines: readonly (readonly Point[])[],
  radius: number,
  closed = false,
): string {
  const at = (value: number): string => String(Math.round((8 + value * radius) * 100) / 100);
  return lines
    .map(
      (line) =>
        line.map(([x, y], index) => `${index === 0 ? 'M' : 'L'}${at(x)} ${at(y)}`).join('') +
        (closed ? 'Z' : ''),
    )
    .join('');
}

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
