import { act as settle, fireEvent, render, screen } from '@testing-library/react';
import { afterEach, beforeEach, expect, test } from 'vitest';

import { receive } from '../store/app';
import { showTags } from '../testing/page';
import { readings, stateFrame, wireTag } from '../testing/tags';
import { Announcer } from './Announcer';
import { startShortcuts } from './shortcuts';

const WELL = 22;
const ILL = 60;

let stop: () => void;
let sec = 10_000;

beforeEach(() => {
  showTags(house([ILL, WELL, WELL, WELL, WELL, WELL]));
  stop = startShortcuts();
  render(<Announcer />);
});
afterEach(() => {
  stop();
});

const house = (temperatures: readonly number[]): ReturnType<typeof wireTag>[] =>
  temperatures.map((temperature, index) =>
    wireTag({ tag_id: String(index + 1), readings: readings({ temperature }) }),
  );

/** The temperatures of tags 1, 2, …, just received. */
const measure = (...temperatures: number[]): void => {
  sec += 1;
  const latest = stateFrame(house(temperatures), { sec, revision: `r${sec}` });
  settle(() => {
    receive({ type: 'state', latest, now: performance.now() });
  });
};
const said = (what: 'said-choice' | 'said-critical'): string | null =>
  screen.getByTestId(what).textContent;
const press = (key: string): void => {
  settle(() => {
    fireEvent.keyDown(document.body, { key });
  });
};

test('the tag that a key chose is told, with its health and place in the table', () => {
  expect(said('said-choice')).toBe('');
  press('n');
  expect(said('said-choice')).toBe('Tag 1, Critical, 1 of 6');
  press('n');
  expect(said('said-choice')).toBe('Tag 2, Healthy, 2 of 6');
  press('p');
  press('p');
  expect(said('said-choice')).toBe('Tag 6, Healthy, 6 of 6');
});

test('a tag that becomes critical is told once; one that was so when the page opened is not', () => {
  expect(said('said-critical')).toBe('');
  measure(ILL, ILL, WELL);
  expect(said('said-critical')).toBe('Critical now: Tag 2, Temperature 60.0\u00a0°C');
  const before = screen.getByTestId('said-critical').firstChild;
  measure(ILL, ILL + 1, WELL);
  expect(screen.getByTestId('said-critical').firstChild).toBe(before);
});

test('the same words said again are another change for a reader to hear', () => {
  measure(WELL, ILL);
  const before = screen.getByTestId('said-critical').firstChild;
  measure(WELL, WELL);
  measure(WELL, ILL);
  expect(said('said-critical')).toContain('Tag 2');
  expect(screen.getByTestId('said-critical').firstChild).not.toBe(before);
});

test('of many only the first are named', () => {
  measure(ILL, ILL, ILL, ILL);
  expect(said('said-critical')).toMatch(/^Critical now: Tag 2.*; Tag 3.*; Tag 4[^;]*C$/);
  measure(WELL, WELL, WELL, WELL, WELL);
  measure(ILL, ILL, ILL, ILL, ILL);
  expect(said('said-critical')).toMatch(/Tag 3[^;]* and 2 more$/);
});
