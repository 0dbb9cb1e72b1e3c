import { beforeEach, expect, test } from 'vitest';

import { FakeContext } from '../testing/canvas';
import { drawFooter, FOOTER_PX, type Footer } from '../export/actions';

const colours = { ink: 'black', surface: 'white' };
const footer: Footer = {
  title: 'Temperature',
  time: '2026-05-01 14:03:22',
  ends: ['20.0', '31.0\u00a0°C'],
  maxAlpha: 0.6,
  colour: [200, 0, 0],
  scale: 40,
};
let context: FakeContext;

beforeEach(() => {
  context = new FakeContext();
});

const texts = (): unknown[] => context.named('fillText').map(({ args }) => args[0]);

test('says what, of when, between which values, and how long a metre is', () => {
  drawFooter(context.asContext(), 360, footer, colours);
  expect(texts()).toEqual(['Temperature', footer.time, '1 m', '20.0', '31.0\u00a0°C']);
  // The bar is as long as the metre that it stands for.
  const [from] = context.named('moveTo').map(({ args }) => Number(args[0]));
  const to = Math.max(...context.named('lineTo').map(({ args }) => Number(args[0])));
  expect(to - (from ?? NaN)).toBe(40);
});

test('the ramp goes from nothing to the sensor’s colour: the pins’, and the heat map’s', () => {
  drawFooter(context.asContext(), 360, footer, colours);
  expect(context.named('addColorStop').map(({ args }) => args)).toEqual([
    [0, 'rgb(200 0 0 / 0)'],
    [1, 'rgb(200 0 0)'],
    [0, 'rgb(200 0 0 / 0)'],
    [1, 'rgb(200 0 0 / 0.6)'],
  ]);
});

test('without a reading there is no ramp', () => {
  drawFooter(context.asContext(), 360, { ...footer, ends: null }, colours);
  expect(context.named('addColorStop')).toEqual([]);
  expect(texts()).toEqual(['Temperature', footer.time, '1 m']);
});

test('nothing of it leaves a phone’s width or covers anything else', () => {
  drawFooter(context.asContext(), 360, { ...footer, scale: 69 }, colours);
  const ends = context.named('fillText').at(-1)?.args ?? [];
  const left = Math.min(...context.named('moveTo').map(({ args }) => Number(args[0])));
  // The fake letters are 6 pixels wide.
  expect(Number(ends[1]) + 6 * String(ends[0]).length).toBeLessThan(left);
  for (const { args } of context.named('fillText')) {
    expect(Number(args[2])).toBeLessThan(FOOTER_PX);
  }
  const length = context.named('fillText').find(({ args }) => args[0] === '1 m')?.args ?? [];
  const end = Math.max(...context.named('lineTo').map(({ args }) => Number(args[0])));
  expect(end).toBeLessThan(Number(length[1]) - 6 * String(length[0]).length);
});
