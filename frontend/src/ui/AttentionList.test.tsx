import { act, render, screen, within } from '@testing-library/react';
import { expect, onTestFinished, test } from 'vitest';

import { shelveAlarms } from '../alarms/own';
import { startAlarms } from '../alarms/watch';
import { started } from '../testing/life';
import { alarm, reportAlarms } from '../testing/alarms';
import { held, judgement, reason } from '../testing/health';
import { showTags } from '../testing/page';
import { wireTag } from '../testing/tags';
import { AttentionList } from './AttentionList';

const rows = (): HTMLElement[] => [...document.querySelectorAll<HTMLElement>('li[data-tag-id]')];
const ids = (): (string | undefined)[] => rows().map((item) => item.dataset['tagId']);
const show = (said: Parameters<typeof judgement>[0]): void => {
  showTags(
    Object.keys(said).map((tag_id) => wireTag({ tag_id })),
    judgement(said),
  );
  render(<AttentionList />);
};
const pest = reason({ kind: 'pest', sensor: '', value: 2, limit: null });
const warm = reason({ verdict: 'stressed', value: 30, limit: 26 });

test('lists who needs somebody and why, the worst first', () => {
  const failed = reason({ kind: 'reading_failed', verdict: 'stressed', value: null, limit: null });
  const twice = [failed, { ...failed, sensor: 'humidity' }];
  const back = { ...warm, value: 25.8, ...held(25.6) };
  show({
    well: 'healthy',
    back: [back],
    warm: [warm],
    far: 'unknown',
    bug: [pest],
    both: [reason(), pest],
    twice,
  });
  // Two tasks at one tag have a row each.
  expect(ids()).toEqual(['both', 'bug', 'both', 'warm', 'twice', 'back']);
  const [first, , second, , failing, last] = rows();
  if (!first) throw new Error('no row');
  // A bare number would read as a count.
  expect(first.firstElementChild?.textContent).toBe('Tagboth');
  const todo = (row?: HTMLElement) => row?.querySelector('.attention-do strong')?.textContent;
  expect(todo(first)).toBe('Inspect and treat the plants');
  expect(todo(second)).toBe('Heat, or close the vents');
  expect(todo(failing)).toBe('Check the sensor');
  if (!failing) throw new Error('no row');
  expect(within(failing).getAllByRole('listitem')).toHaveLength(2);
  expect(todo(last)).toBe('Keep an eye on it');
});

test('what ails more than a few tags has one line, as among the alarms, and the rest a line each', () => {
  const many = (count: number) =>
    Object.fromEntries(
      Array.from({ length: count }, (_, at) => [`${at + 1}`, [reason({ value: 9 - at / 10 })]]),
    );
  show(many(4));
  expect(ids()).toHaveLength(4);
  document.body.replaceChildren();
  show({ ...many(11), bug: [pest] });
  expect(ids()).toEqual(['bug']);
  const [cause] = document.querySelectorAll<HTMLElement>('li[data-cause]');
  expect(cause?.parentElement?.style.getPropertyValue('--rows')).toBe('3');
  expect(cause?.textContent).toMatch(
    /^11\u202f×.*Temperature too lowHeat, or close the vents Tag 11: Temperature 8.0.*Tags 11, 10, .* 4 and 3 more/,
  );
});

test('of what ails many as well, since when it is active where it is worst', () => {
  onTestFinished(started(startAlarms));
  const cold = (at: number) => reason({ value: 9 - at / 10 });
  act(() => {
    reportAlarms(alarm('a', { tag_id: '13', reason: cold(13) }));
  });
  show(Object.fromEntries(Array.from({ length: 13 }, (_, at) => [`${at + 1}`, [cold(at + 1)]])));
  const [cause] = document.querySelectorAll('li[data-cause]');
  const facts = [...(cause?.querySelectorAll('small .dotted > *') ?? [])];
  expect(facts.map(({ textContent }) => textContent)).toEqual([
    expect.stringMatching(/^Tag 13: Temperature/),
    expect.stringMatching(/^since/),
    expect.stringMatching(/^Tags 13/),
  ]);
});

test('ends with how many more tags there are', () => {
  const areas = (at: number) => [reason({ sensor: `s${Math.floor(at / 3)}` })];
  show(Object.fromEntries(Array.from({ length: 43 }, (_, at) => [`t${at}`, areas(at)])));
  expect(ids()).toHaveLength(40);
  expect(screen.getByText('+ 3 more')).toBeTruthy();
});

test('says so when nobody does, and when that is not known', () => {
  show({ well: 'healthy' });
  expect(ids()).toEqual([]);
  expect(screen.getByRole('heading').textContent).toBe('Nothing needs attention');
  document.body.replaceChildren();
  show({ well: 'healthy', far: 'unknown' });
  expect(screen.getByRole('heading').textContent).toMatch(/no data for 1 tag$/);
  document.body.replaceChildren();
  show({});
  expect(screen.queryByRole('heading')).toBeNull();
});

test('if all is shelved, or the robot stands still, it does not say that nothing needs attention', () => {
  const said = judgement({ bug: [pest] });
  showTags([wireTag({ tag_id: 'bug' })], said);
  onTestFinished(started(startAlarms));
  render(<AttentionList />);
  act(() => {
    const pestAlarm = alarm('a', { tag_id: 'bug', reason: pest });
    reportAlarms(pestAlarm);
    shelveAlarms([{ alarm: pestAlarm }], 15, 'treated');
  });
  expect(ids()).toEqual([]);
  expect(screen.queryByRole('heading')).toBeNull();
  document.body.replaceChildren();
  const well = judgement({ well: 'healthy' });
  const stopped = reason({ kind: 'stopped', verdict: 'unknown', sensor: '', value: null });
  showTags([wireTag({ tag_id: 'well' })], {
    ...well,
    house: { ...well.house, verdict: 'unknown', reasons: [stopped] },
  });
  render(<AttentionList />);
  expect(screen.queryByRole('heading')).toBeNull();
});
