import { describe, expect, test } from 'vitest';

import { VERDICTS } from '../domain/health';
import type { Rgb } from '../domain/ramp';
import { THEMES } from '../testing/colours';

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

describe.each(THEMES)('pins in the %s theme', (_, token) => {
  test('each sign stands out from its body, and each body or its line from its halo', () => {
    const halo = token('map-halo');
    for (const verdict of VERDICTS) {
      const [body, ink] = [token(`pin-${verdict}`), token(`pin-${verdict}-ink`)];
      expect(contrast(body, ink), verdict).toBeGreaterThan(4.5);
      const [own, empty] = [token(verdict), token('pin-unknown')];
      expect(contrast(own, empty), verdict).toBeGreaterThan(4.5);
      const line = verdict === 'unknown' ? ink : token('pin-line');
      const most = Math.max(contrast(body, halo), contrast(line, halo));
      expect(most, verdict).toBeGreaterThan(3);
    }
  });

  test.each(Object.entries(BLIND))('bodies are told apart with %s', (_, matrix) => {
    for (const a of VERDICTS) {
      for (const b of VERDICTS) {
        if (a >= b) continue;
        const [one, other] = [a, b].map((each) => seen(token(`pin-${each}`), matrix));
        if (!one || !other) continue;
        const distance = Math.hypot(...one.map((c, i) => c - (other[i] ?? 0)));
        expect(distance, `${a} and ${b}`).toBeGreaterThan(60);
      }
    }
  });

  test('text on the map can be read', () => {
    expect(contrast(token('map-label-text'), token('map-label'))).toBeGreaterThan(7);
  });
});
