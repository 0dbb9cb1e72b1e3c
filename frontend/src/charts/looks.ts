/** How the lines of one chart are told apart: by colour, dash and marker, so that none has to do. */

export type Marker = 'circle' | 'square' | 'diamond' | 'up' | 'cross' | 'down' | 'plus' | 'ring';

export interface Look {
  /** Of `--chart-1` to `--chart-8` in the style sheet. */
  readonly colour: number;
  /** Strokes and pauses, CSS pixels; empty: one stroke. */
  readonly dash: readonly number[];
  readonly marker: Marker;
}

const LOOKS: readonly Look[] = [
  { colour: 0, dash: [], marker: 'circle' },
  { colour: 1, dash: [8, 4], marker: 'square' },
  { colour: 2, dash: [2, 3], marker: 'diamond' },
  { colour: 3, dash: [12, 3, 2, 3], marker: 'up' },
  { colour: 4, dash: [5, 2], marker: 'cross' },
  { colour: 5, dash: [8, 3, 2, 3, 2, 3], marker: 'down' },
  { colour: 6, dash: [3, 6], marker: 'plus' },
  { colour: 7, dash: [14, 5], marker: 'ring' },
];

const FIRST: Look = { colour: 0, dash: [], marker: 'circle' };

/** The look of the line with that place in the list; each keeps its own while others go. */
export const lookOf = (index: number): Look => LOOKS[index % LOOKS.length] ?? FIRST;

/** Outline of a marker around a point; `size` is its width. Filled but for crosses and the ring. */
export function markerPath(marker: Marker, x: number, y: number, size: number): string {
  const r = size / 2;
  const line = (...points: readonly (readonly [number, number])[]): string =>
    `M${points.map(([dx, dy]) => `${x + dx * r} ${y + dy * r}`).join('L')}`;
  switch (marker) {
    case 'circle':
    case 'ring':
      return `M${x - r} ${y}a${r} ${r} 0 1 0 ${size} 0a${r} ${r} 0 1 0 ${-size} 0Z`;
    case 'square':
      return `${line([-0.9, -0.9], [0.9, -0.9], [0.9, 0.9], [-0.9, 0.9])}Z`;
    case 'diamond':
      return `${line([0, -1.2], [1.2, 0], [0, 1.2], [-1.2, 0])}Z`;
    case 'up':
      return `${line([0, -1.1], [1.1, 0.9], [-1.1, 0.9])}Z`;
    case 'down':
      return `${line([0, 1.1], [1.1, -0.9], [-1.1, -0.9])}Z`;
    case 'cross':
      return line([-1, -1], [1, 1]) + line([1, -1], [-1, 1]);
    case 'plus':
      return line([-1.2, 0], [1.2, 0]) + line([0, -1.2], [0, 1.2]);
  }
}

/** Markers that are strokes alone. */
export const isStroked = (marker: Marker): boolean =>
  marker === 'cross' || marker === 'plus' || marker === 'ring';
