import { act as flush, render, screen } from '@testing-library/react';
import { beforeEach, expect, test } from 'vitest';

import type { StatusFrame } from '../contract/types';
import { rosText } from '../domain/time';
import { act, receive } from '../store/app';
import { NO_HOUSE, withPast } from '../store/twin';
import { goLive, showTags, status } from '../testing/page';
import { SimulatedNote } from './Header';

const START = 1_763_440_800;
const END = 1_763_700_000;
const time = (sec: number): number => sec;

const note = (): string => screen.getByTestId('simulated').textContent;
const filled = (): StatusFrame => {
  const journal = { state: 'recording', detail: '', set_aside: '' } as const;
  return status({ journal: { ...journal, simulated: { start: time(START), end: time(END) } } });
};
const lookBack = (at: number | null): void => {
  flush(() => {
    if (at !== null) receive(withPast({ at, house: NO_HOUSE }));
    act({ moment: at });
  });
};

beforeEach(() => {
  showTags([]);
  goLive(filled());
});

test('a moment that a simulation made is said to be simulated, and no other', () => {
  render(<SimulatedNote />);
  expect(note()).toBe('');
  lookBack(END - 1);
  expect(note()).toBe(`Simulated. All data until ${rosText(END)} is demo data, not measured.`);
  lookBack(END);
  expect(note()).toBe('');
  lookBack(START);
  expect(note()).not.toBe('');
  lookBack(null);
  expect(note()).toBe('');
});

test('of a simulation no end is told, as if later data were real', () => {
  goLive({ ...filled(), origin: 'simulated' });
  render(<SimulatedNote />);
  lookBack(END - 1);
  expect(note()).toBe('');
});

test('where nothing was filled in, nothing is simulated', () => {
  goLive(status());
  render(<SimulatedNote />);
  lookBack(START);
  expect(note()).toBe('');
});
