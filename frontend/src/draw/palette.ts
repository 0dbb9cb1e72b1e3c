import { mix, rgbText, type Rgb } from '../domain/ramp';

/** Colours of the map view; those of the page itself are in `styles/tokens.css`. */
export const LIGHT = {
  /** Behind everything: what nobody has explored. */
  ground: [232, 235, 231] as Rgb,
  /** Free floor and walls of the SLAM map. */
  floor: [253, 253, 252] as Rgb,
  wall: [84, 94, 88] as Rgb,
  /** Strokes over what is not known, and the line where the known ends. */
  hatch: 'rgb(60 72 65 / 0.34)',
  edge: 'rgb(40 52 45 / 0.7)',
  gridLine: 'rgb(23 33 27 / 0.09)',
  gridText: 'rgb(23 33 27 / 0.62)',
  boxFill: 'rgb(110 84 52 / 0.14)',
  boxLine: 'rgb(110 84 52 / 0.75)',
  /** Marks of verdicts, as the style sheet has them (`--pin-…`); `line`: of one whose body is empty. */
  verdicts: {
    critical: { body: '#c4211a', ink: '#ffffff', line: '#b3261e' },
    stressed: { body: '#f5a800', ink: '#17211b', line: '#855300' },
    unknown: { body: '#ffffff', ink: '#5a665f', line: '#5a665f' },
    healthy: { body: '#1f7a45', ink: '#ffffff', line: '#1a6b3a' },
  },
  pinLine: '#17211b',
  labelFill: 'rgb(255 255 255 / 0.86)',
  labelText: 'rgb(23 33 27)',
  bloomLine: 'rgb(23 33 27 / 0.7)',
  pest: 'rgb(179 38 30)',
  pestInk: 'rgb(255 255 255)',
  accent: 'rgb(81 70 179)',
  halo: 'rgb(255 255 255 / 0.9)',
};

export type Palette = typeof LIGHT;

export const DARK: Palette = {
  ground: [16, 21, 19],
  floor: [32, 40, 36],
  wall: [140, 153, 146],
  hatch: 'rgb(200 212 205 / 0.3)',
  edge: 'rgb(214 224 218 / 0.65)',
  gridLine: 'rgb(230 236 232 / 0.08)',
  gridText: 'rgb(230 236 232 / 0.66)',
  boxFill: 'rgb(214 178 128 / 0.14)',
  boxLine: 'rgb(214 178 128 / 0.6)',
  verdicts: {
    critical: { body: '#ff6456', ink: '#10150f', line: '#ff9d94' },
    stressed: { body: '#ffd166', ink: '#10150f', line: '#f2c063' },
    unknown: { body: '#161c19', ink: '#a3b0a9', line: '#a3b0a9' },
    healthy: { body: '#52c7b0', ink: '#10150f', line: '#7fd49b' },
  },
  pinLine: '#10150f',
  labelFill: 'rgb(16 21 19 / 0.82)',
  labelText: 'rgb(238 243 240)',
  bloomLine: 'rgb(16 21 19 / 0.8)',
  pest: 'rgb(255 157 148)',
  pestInk: 'rgb(40 8 6)',
  accent: 'rgb(178 170 255)',
  halo: 'rgb(16 21 19 / 0.9)',
};

/**
 * Where the system has a few colours for everything (high contrast): lines and marks in that of text,
 * verdicts by their shapes and signs alone. `of` gives a system colour by its CSS name.
 */
export function forcedPalette(of: (name: string) => Rgb): Palette {
  const ground = of('Canvas');
  const ink = of('CanvasText');
  const text = rgbText(ink);
  const paper = rgbText(ground);
  const full = { body: text, ink: paper, line: text };
  const empty = { body: paper, ink: text, line: text };
  return {
    ground,
    floor: mix(ground, ink, 0.08),
    wall: ink,
    hatch: rgbText(ink, 0.5),
    edge: text,
    gridLine: rgbText(ink, 0.25),
    gridText: text,
    boxFill: rgbText(ink, 0.1),
    boxLine: text,
    verdicts: {
      critical: full,
      stressed: full,
      unknown: empty,
      healthy: empty,
    },
    pinLine: text,
    labelFill: paper,
    labelText: text,
    bloomLine: text,
    pest: text,
    pestInk: paper,
    accent: rgbText(of('Highlight')),
    halo: paper,
  };
}
