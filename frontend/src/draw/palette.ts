import type { Rgb } from '../domain/ramp';

/** Colours of the map view; those of the page itself are in `styles/tokens.css`. */
export interface Palette {
  readonly name: 'light' | 'dark';
  /** Behind everything: what nobody has explored. */
  readonly ground: Rgb;
  /** Free floor and walls of the SLAM map. */
  readonly floor: Rgb;
  readonly wall: Rgb;
  readonly gridLine: string;
  readonly gridText: string;
  readonly boxFill: string;
  readonly boxLine: string;
  /** Body of a pin at the range's minimum. */
  readonly pinBody: Rgb;
  readonly pinLine: string;
  readonly labelFill: string;
  readonly labelText: string;
  readonly bloomLine: string;
  readonly pest: string;
  readonly pestInk: string;
  readonly accent: string;
  readonly halo: string;
}

export const LIGHT: Palette = {
  name: 'light',
  ground: [232, 235, 231],
  floor: [253, 253, 252],
  wall: [84, 94, 88],
  gridLine: 'rgb(23 33 27 / 0.09)',
  gridText: 'rgb(23 33 27 / 0.62)',
  boxFill: 'rgb(110 84 52 / 0.14)',
  boxLine: 'rgb(110 84 52 / 0.75)',
  pinBody: [255, 255, 255],
  pinLine: 'rgb(23 33 27)',
  labelFill: 'rgb(255 255 255 / 0.86)',
  labelText: 'rgb(23 33 27)',
  bloomLine: 'rgb(23 33 27 / 0.7)',
  pest: 'rgb(179 38 30)',
  pestInk: 'rgb(255 255 255)',
  accent: 'rgb(81 70 179)',
  halo: 'rgb(255 255 255 / 0.9)',
};

export const DARK: Palette = {
  name: 'dark',
  ground: [16, 21, 19],
  floor: [32, 40, 36],
  wall: [140, 153, 146],
  gridLine: 'rgb(230 236 232 / 0.08)',
  gridText: 'rgb(230 236 232 / 0.66)',
  boxFill: 'rgb(214 178 128 / 0.14)',
  boxLine: 'rgb(214 178 128 / 0.6)',
  pinBody: [20, 26, 23],
  pinLine: 'rgb(238 243 240)',
  labelFill: 'rgb(16 21 19 / 0.82)',
  labelText: 'rgb(238 243 240)',
  bloomLine: 'rgb(16 21 19 / 0.8)',
  pest: 'rgb(255 157 148)',
  pestInk: 'rgb(40 8 6)',
  accent: 'rgb(178 170 255)',
  halo: 'rgb(16 21 19 / 0.9)',
};
