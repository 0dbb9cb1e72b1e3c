import { describe, expect, test } from 'vitest';

import { placeLabels, type LabelRequest, type PlacedLabel } from './clear';

const HEIGHT = 18;

const request = (over: Partial<LabelRequest>): LabelRequest => ({
  id: 'a',
  x: 0,
  y: 0,
  radius: 8,
  priority: 0,
  texts: [
    { text: 'a · 21.5 °C', width: 70 },
    { text: 'a', width: 14 },
  ],
  ...over,
});

const overlap = (a: PlacedLabel, b: PlacedLabel): boolean =>
  a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + HEIGHT && b.y < a.y + HEIGHT;

describe('labels', () => {
  test('one alone stands to the right of its pin with its long text', () => {
    const [label] = placeLabels([request({})], HEIGHT);
    expect(label).toMatchObject({ text: 'a · 21.5 °C', x: 12, y: -9 });
  });

  test('one beside the edge or the buttons goes where it can be seen', () => {
    const within = { left: -200, top: -200, right: 40, bottom: 200 };
    const [atEdge] = placeLabels([request({})], HEIGHT, { within, covered: [] });
    expect(atEdge).toMatchObject({ text: 'a · 21.5 °C', x: -82 });
    const buttons = { left: -100, top: -100, right: -20, bottom: 100 };
    const [between] = placeLabels([request({})], HEIGHT, { within, covered: [buttons] });
    expect(between).toMatchObject({ text: 'a', x: 12 });
    // Out of sight anyway: it comes in with the pan.
    const [beyond] = placeLabels([request({ x: 50 })], HEIGHT, { within, covered: [] });
    expect(beyond).toMatchObject({ text: 'a · 21.5 °C', x: 62 });
  });

  test('a crowd never overlaps, and still shows a good part of itself', () => {
    const crowd = Array.from({ length: 60 }, (_, i) =>
      request({ id: String(i), x: (i % 10) * 40, y: Math.floor(i / 10) * 30 }),
    );
    const placed = placeLabels(crowd, HEIGHT);
    expect(placed.length).toBeGreaterThan(20);
    for (const a of placed) {
      for (const b of placed) if (a !== b) expect(overlap(a, b)).toBe(false);
    }
  });

  test('where it is tight the shorter text is taken', () => {
    const wall = [-1, 1].map((side) => request({ id: `w${side}`, x: side * 50, texts: [] }));
    const [label] = placeLabels([request({ y: 0 }), ...wall], HEIGHT).filter((l) => l.id === 'a');
    expect(label?.text).toBe('a · 21.5 °C');
    const ring = [-40, 40].flatMap((x) =>
      [-26, 0, 26].map((y) => request({ id: `r${x},${y}`, x, y, texts: [] })),
    );
    const [tight] = placeLabels([request({}), ...ring], HEIGHT);
    expect(tight?.text).toBe('a');
  });

  test('the important one is placed first', () => {
    const both = [request({ id: 'low' }), request({ id: 'high', x: 2, priority: 5 })];
    expect(placeLabels(both, HEIGHT)[0]?.id).toBe('high');
  });

  test('a label does not cover another pin', () => {
    const [label] = placeLabels([request({}), request({ id: 'b', x: 30, texts: [] })], HEIGHT);
    expect(label?.x).toBeLessThan(0);
  });
});
