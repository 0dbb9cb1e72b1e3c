/** The colours of the style sheet, without mixing. */
import { readFileSync } from 'node:fs';
import { join } from 'node:path';

import type { Rgb } from '../domain/ramp';

const CSS = readFileSync(join(import.meta.dirname, '../styles/tokens.css'), 'utf8');
const [light = '', dark = ''] = CSS.split("[data-theme='dark']");

type Token = (name: string) => Rgb;

const tokenIn =
  (css: string): Token =>
  (name) => {
    const text = new RegExp(`--${name}: (.*);`).exec(css)?.[1] ?? '';
    const parts = text.startsWith('#')
      ? [1, 3, 5].map((at) => parseInt(text.slice(at, at + 2), 16))
      : (text.match(/[\d.]+/g) ?? []).map(Number);
    return [parts[0] ?? NaN, parts[1] ?? NaN, parts[2] ?? NaN];
  };

export const THEMES = [
  ['light', tokenIn(light)],
  ['dark', tokenIn(dark)],
] as const;
