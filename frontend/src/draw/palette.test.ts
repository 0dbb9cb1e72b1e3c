import { readFileSync } from 'node:fs';
import { join } from 'node:path';

import { describe, expect, test } from 'vitest';

import { VERDICTS } from '../domain/health';
import type { Rgb } from '../domain/ramp';
import { DARK, forcedPalette, LIGHT } from './palette';

const rgb = (text: string): Rgb => {
  const parts = text.startsWith('#')
    ? [1, 3, 5].map((at) => parseInt(text.slice(at, at + 2), 16))
    : (text.match(/[\d.]+/g) ?? []).map(Number);
  return [parts[0] ?? NaN, parts[1] ?? NaN, parts[2] ?? NaN];
};

const linear = (channel: number): number => {
  const c = channel / 255;
  return c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4;
};

/** WCAG 2.2, relative luminance. */
const luminance = (colour: Rgb): number => {
  const [r, g, b] = colour.map(linear) as [number, number, number];
  return 0.2126 * r + 0.7152 * g + 0.0722 * b;
};

const contrast = (a: Rgb, b: Rgb): number => {
  const [low, high] = [luminance(a), luminance(b)].sort((x, y) => x - y) as [number, number];
  return (high + 0.05) / (low + 0.05);
};

/** Machado, Oliveira, Fernandes 2009, severity 1. */
const BLIND = {
  protanopia: [
    [0.152286, 1.052583, -0.204868],
    [0.114503, 0.786281, 0.099216],
    [-0.003882, -0.048116, 1.051998],
  ],
  deuteranopia: [
    [0.367322, 0.860646, -0.227968],
    [0.280085, 0.672501, 0.047413],
    [-0.01182, 0.04294, 0.968881],
  ],
  tritanopia: [
    [1.255528, -0.076749, -0.178779],
    [-0.078411, 0.930809, 0.147602],
    [0.004733, 0.691367, 0.3039],
  ],
};

const seen = (colour: Rgb, matrix: readonly (readonly number[])[]): Rgb => {
  const from = colour.map(linear);
  const row = (weights: readonly number[]): number => {
    const sum = weights.reduce((total, weight, i) => total + weight * (from[i] ?? 0), 0);
    const c = Math.min(1, Math.max(0, sum));
    return 255 * (c <= 0.0031308 ? 12.92 * c : 1.055 * c ** (1 / 2.4) - 0.055);
  };
  return matrix.map(row) as unknown as Rgb;
};

const THEMES = [
  ['light', LIGHT],
  ['dark', DARK],
] as const;

describe.each(THEMES)('pins in the %s theme', (name, palette) => {
  test('each sign stands out from its body, and each body or its line from its halo', () => {
    const halo = rgb(palette.halo);
    for (const verdict of VERDICTS) {
      const { body, ink, line: own } = palette.verdicts[verdict];
      expect(contrast(rgb(body), rgb(ink)), verdict).toBeGreaterThan(4.5);
      const empty = rgb(palette.verdicts.unknown.body);
      expect(contrast(rgb(own), empty), verdict).toBeGreaterThan(4.5);
      const line = rgb(verdict === 'unknown' ? ink : palette.pinLine);
      const most = Math.max(contrast(rgb(body), halo), contrast(line, halo));
      expect(most, verdict).toBeGreaterThan(3);
    }
  });

  test.each(Object.entries(BLIND))('bodies are told apart with %s', (_, matrix) => {
    for (const a of VERDICTS) {
      for (const b of VERDICTS) {
        if (a >= b) continue;
        const [one, other] = [a, b].map((each) => seen(rgb(palette.verdicts[each].body), matrix));
        if (!one || !other) continue;
        const distance = Math.hypot(...one.map((c, i) => c - (other[i] ?? 0)));
        expect(distance, `${a} and ${b}`).toBeGreaterThan(60);
      }
    }
  });

  test('are those of the style sheet', () => {
    const css = readFileSync(join(import.meta.dirname, '../styles/tokens.css'), 'utf8');
    const block = css.split("[data-theme='dark']")[name === 'dark' ? 1 : 0] ?? '';
    for (const verdict of VERDICTS) {
      const { body, ink, line } = palette.verdicts[verdict];
      expect(block).toContain(`--${verdict}: ${line};`);
      expect(block).toContain(`--pin-${verdict}: ${body};`);
      expect(block).toContain(`--pin-${verdict}-ink: ${ink};`);
    }
    expect(block).toContain(`--pin-line: ${palette.pinLine};`);
  });
});

test('with forced colours there are none but the system’s', () => {
  const system: Record<string, Rgb> = {
    Canvas: [0, 0, 0],
    CanvasText: [255, 255, 255],
    Highlight: [26, 235, 255],
  };
  const { verdicts, ...rest } = forcedPalette((name) => system[name] ?? [1, 2, 3]);
  const texts = [...Object.values(verdicts).flatMap(({ body, ink, line }) => [body, ink, line])];
  expect(new Set(texts)).toEqual(new Set(['rgb(0 0 0)', 'rgb(255 255 255)']));
  expect(rest.accent).toBe('rgb(26 235 255)');
  expect(rest.wall).toEqual([255, 255, 255]);
});
