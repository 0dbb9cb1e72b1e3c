import { expect, test } from 'vitest';

import { chosenAt, momentAt, pixelS, stepped, xOf, type Axis } from './axis';

const AXIS: Axis = { from: 1_000, to: 2_000, width: 500 };

test('there and back', () => {
  expect(xOf(AXIS, 1_500)).toBe(250);
  expect(momentAt(AXIS, 250)).toBe(1_500);
  expect(momentAt(AXIS, -3)).toBe(1_000);
  expect(momentAt(AXIS, 503)).toBe(2_000);
  expect(pixelS(AXIS)).toBe(2);
});

test('a bar that has no width yet divides by nothing', () => {
  const flat = { ...AXIS, width: 0 };
  expect(momentAt(flat, 5)).toBe(1_000);
  expect(pixelS(flat)).toBe(1_000);
});

test('the end of a bar that ends now is now, six pixels wide', () => {
  expect(chosenAt(AXIS, 493, 2_000)).toBe(1_986);
  expect(chosenAt(AXIS, 494, 2_000)).toBeNull();
  // The last bucket goes a bit beyond now.
  expect(chosenAt(AXIS, 480, 1_960)).toBeNull();
  expect(chosenAt(AXIS, 499, 1_960)).toBeNull();
});

test('the end of a bar that has long been over is a moment like any other', () => {
  expect(chosenAt(AXIS, 500, 9_000)).toBe(2_000);
});

test('a step goes from where it stands, ends at now, and does not leave the bar backwards', () => {
  expect(stepped(AXIS, 1_500, -2, 2_000)).toBe(1_498);
  expect(stepped(AXIS, null, -2, 1_999)).toBe(1_997);
  expect(stepped(AXIS, 1_998, 2, 2_000)).toBeNull();
  expect(stepped(AXIS, 1_001, -20, 2_000)).toBe(1_000);
  // A link's moment may lie before the bar; the way to the bar is open.
  expect(stepped(AXIS, 400, 10, 2_000)).toBe(410);
  expect(stepped(AXIS, 400, -10, 2_000)).toBe(400);
});
