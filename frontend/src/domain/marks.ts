/**
 * The look of a verdict without its colour: one outline and one sign each, the same on the map, in
 * the table and in the legend. Outlines differ as silhouettes, so that a pin of a few pixels is told
 * by whoever sees no colours. About the origin, y down; most of an outline is at radius 1.
 */
import type { Verdict } from '../contract/types';

export type Point = readonly [number, number];

export interface Mark {
  /** A closed line; "circle": one of radius 1. */
  readonly outline: readonly Point[] | 'circle';
  /** What is drawn on it: open lines; a dot is a line of no length. */
  readonly sign: readonly (readonly Point[])[];
  /** Nothing is known: the outline alone. */
  readonly isHollow: boolean;
}

const SQUARE = 0.92;

export const MARKS: Readonly<Record<Verdict, Mark>> = {
  critical: {
    outline: [
      [-SQUARE, -SQUARE],
      [SQUARE, -SQUARE],
      [SQUARE, SQUARE],
      [-SQUARE, SQUARE],
    ],
    sign: [
      [
        [-0.42, -0.42],
        [0.42, 0.42],
      ],
      [
        [0.42, -0.42],
        [-0.42, 0.42],
      ],
    ],
    isHollow: false,
  },
  stressed: {
    outline: [
      [0, -1.08],
      [1.14, 0.9],
      [-1.14, 0.9],
    ],
    sign: [
      [
        [0, -0.34],
        [0, 0.24],
      ],
      [
        [0, 0.6],
        [0, 0.61],
      ],
    ],
    isHollow: false,
  },
  unknown: { outline: 'circle', sign: [], isHollow: true },
  healthy: {
    outline: 'circle',
    sign: [
      [
        [-0.44, 0.04],
        [-0.12, 0.36],
        [0.46, -0.3],
      ],
    ],
    isHollow: false,
  },
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
