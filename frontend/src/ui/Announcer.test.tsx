import { act as settle, fireEvent, render, screen } from '@testing-library/react';
import { afterEach, beforeAll, beforeEach, expect, test } from 'vitest';

import { politeVoice, urgentVoice } from '../alarms/watch';
import { announce } from '../store/create';
import { started } from '../testing/life';
import { judgement, reason } from '../testing/health';
import { showTags } from '../testing/page';
import { readings, wireTag } from '../testing/tags';
import { Announcer } from './Announcer';
import { startKeys } from './keys';
import { loadParts } from './loadDeferred';

beforeAll(() => loadParts());

const WELL = 22;
const ILL = 60;

let stop: () => void;

beforeEach(() => {
  showTags(house([ILL, WELL, WELL, WELL, WELL, WELL]), judged([ILL, WELL, WELL, WELL, WELL, WELL]));
  stop = started(startKeys);
  render(<Announcer />);
});
afterEach(() => {
  stop();
});

const house = (temperatures: readonly number[]): ReturnType<typeof wireTag>[] =>
  temperatures.map((temperature, index) =>
    wireTag({ tag_id: String(index + 1), readings: readings({ temperature }) }),
  );

/** A judgement with these temperatures, °C, one tag each. */
const judged = (temperatures: readonly number[]): ReturnType<typeof judgement> =>
  judgement(
    Object.fromEntries(
      temperatures.map((value, index) => [
        String(index + 1),
        value >= ILL ? [reason({ value, limit: 35 })] : 'healthy',
      ]),
    ),
  );

const said = (
  what: 'announced-choice' | 'announced-alarms' | 'announced-critical',
): string | null => screen.getByTestId(what).textContent;
const press = (key: string): void => {
  settle(() => {
    fireEvent.keyDown(document.body, { key });
  });
};

test('the tag chosen by a key is announced, with its health and place in the table', () => {
  expect(said('announced-choice')).toBe('');
  press('n');
  expect(said('announced-choice')).toBe('Tag 1, Critical, 1 of 6');
  press('n');
  expect(said('announced-choice')).toBe('Tag 2, Healthy, 2 of 6');
  press('p');
  press('p');
  expect(said('announced-choice')).toBe('Tag 6, Healthy, 6 of 6');
});

test('only what is critical cuts in: it has a voice of its own', () => {
  expect(screen.getByTestId('announced-alarms').getAttribute('role')).toBe('status');
  expect(screen.getByTestId('announced-critical').getAttribute('role')).toBe('alert');
  settle(() => {
    announce(urgentVoice, 'New: Tag 2');
  });
  expect(said('announced-critical')).toBe('New: Tag 2');
  expect(said('announced-alarms')).toBe('');
});

test('the same words said again are another change for a reader to hear', () => {
  settle(() => {
    announce(politeVoice, 'New: Tag 3');
  });
  const before = screen.getByTestId('announced-alarms').firstChild;
  settle(() => {
    announce(politeVoice, 'New: Tag 3');
  });
  expect(said('announced-alarms')).toBe('New: Tag 3');
  expect(screen.getByTestId('announced-alarms').firstChild).not.toBe(before);
});
