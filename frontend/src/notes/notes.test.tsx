import { act as flush, fireEvent, render, screen, waitFor } from '@testing-library/react';
import { beforeEach, expect, test, vi } from 'vitest';

import type { Note } from '../contract/types';
import { act, receive } from '../store/app';
import { person } from '../store/create';
import { started } from '../testing/life';
import { alarm, alarms } from '../testing/alarms';
import { showTags } from '../testing/page';
import { clustersOf, NoteMarks, standing, standingNotes, startNotes } from './NoteMarks';
import { CommentField, Comments, SiteComment } from './Comments';

const said = (id: string, made: number, over: Partial<Note> = {}): Note => ({
  id,
  kind: 'comment',
  subject: 'tag:7',
  text: id,
  until: null,
  made_at: made,
  by: 'anna',
  withdrawn_by: null,
  withdrawn_at: null,
  ...over,
});

const ANNA = {
  can_sign_out: true,
  seconds_left: null,
  name: 'anna',
  role: 'operator',
  can_write_notes: true,
} as const;

let requests: string[] = [];
let notes: readonly Note[] = [];

beforeEach(() => {
  requests = [];
  notes = [];
  standingNotes.set([]);
  person.set(null);
  showTags([]);
  vi.stubGlobal('fetch', (url: URL, { method = 'GET', body }: RequestInit) => {
    requests.push(`${method} ${url.pathname}${url.search} ${typeof body === 'string' ? body : ''}`);
    return Promise.resolve(Response.json({ notes }));
  });
});

/** Receives a frame saying that the journal has this many notes. */
const report = (count: number): void => {
  flush(() => {
    receive({ alarms: { ...alarms([alarm('cold')]), notes: count } });
  });
};

test('a comment stands where it is about, until it is withdrawn', () => {
  const then = said('then', 900, { until: 100, text: 'two\nlines' });
  const gone = said('gone', 950, { withdrawn_by: 'anna' });
  expect(standing([gone, then, said('now', 800)])).toEqual([
    expect.objectContaining({ id: 'then', text: 'two lines', by: 'anna', at: 100 }),
    expect.objectContaining({ id: 'now', text: 'now', by: 'anna', at: 800 }),
  ]);
});

test('marks that would cover each other are one, and those outside of the span none', () => {
  const found = standing([950, 510, 501, 500, 10].map((at) => said(String(at), at)));
  const clusters = clustersOf(found, { from: 100, to: 1_100 });
  expect(clusters.map((it) => [it.at, it.notes.length])).toEqual([
    [500, 3],
    [950, 1],
  ]);
});

test('comments are fetched when their number grows, and shown with name and time', async () => {
  const stop = started(startNotes);
  render(<Comments subject="tag:7" name="Tag 7" />);
  report(0);
  expect(requests).toEqual([]);
  notes = [said('leaf sample', 800), said('other', 800, { subject: 'tag:8' })];
  report(2);
  await screen.findByText('leaf sample');
  expect(screen.getByTestId('comments').textContent).toContain('anna sim 00:13:20 leaf sample');
  expect(screen.queryByText('other')).toBeNull();
  expect(screen.queryByRole('button')).toBeNull();
  report(2);
  expect(requests).toEqual(['GET /api/notes ']);
  stop();
});

test('who may write does, and withdraws their own words alone', async () => {
  person.set(ANNA);
  standingNotes.set(standing([said('mine', 800), said('bert’s', 700, { by: 'bert' })]));
  render(<Comments subject="tag:7" name="Tag 7" />);
  expect(screen.getAllByRole('button', { name: /^Withdraw/ })).toHaveLength(1);
  fireEvent.click(screen.getByRole('button', { name: 'Withdraw: mine' }));
  fireEvent.click(screen.getByRole('button', { name: 'Comment: Tag 7' }));
  fireEvent.change(screen.getByLabelText('Comment (now)'), { target: { value: ' dry ' } });
  fireEvent.click(screen.getByRole('button', { name: 'Save' }));
  await waitFor(() => {
    expect(screen.queryByLabelText('Comment (now)')).toBeNull();
  });
  expect(requests).toEqual([
    'DELETE /api/notes/mine ',
    'POST /api/notes {"kind":"comment","subject":"tag:7","text":"dry"}',
  ]);
});

test('each alarm of a heading gets the comment once, also after a failure', async () => {
  // The first alarm is gone, which the bridge says each time; the third has no connection at first.
  const answers = [404, 200, 0, 404, 200, 200];
  const posted: unknown[] = [];
  vi.stubGlobal('fetch', (_: URL, { body }: { body: string }) => {
    const { subject } = JSON.parse(body) as { subject: string };
    posted.push(subject);
    const status = answers.shift();
    const detail = 'no such alarm';
    return status
      ? Promise.resolve(Response.json({ detail }, { status }))
      : Promise.reject(new TypeError());
  });
  const onDone = vi.fn();
  const subjects = ['alarm:a', 'alarm:b', 'alarm:c'];
  render(<CommentField subjects={subjects} moment={null} onDone={onDone} />);
  fireEvent.change(screen.getByLabelText('Comment (now)'), { target: { value: 'valve stuck' } });
  const save = screen.getByRole('button', { name: 'Save' });
  fireEvent.click(save);
  expect((await screen.findByRole('alert')).textContent).toMatch(/^Not saved/);
  fireEvent.click(save);
  await screen.findByText(/no such alarm/);
  fireEvent.click(save);
  await waitFor(() => {
    expect(onDone).toHaveBeenCalledOnce();
  });
  expect(posted.join(' ')).toBe('alarm:a alarm:b alarm:c alarm:a alarm:c alarm:a');
});

test('Escape leaves the field, and not what it stands in', () => {
  person.set(ANNA);
  render(<Comments subject="tag:7" name="Tag 7" />);
  fireEvent.click(screen.getByRole('button', { name: 'Comment: Tag 7' }));
  expect(fireEvent.keyDown(screen.getByLabelText('Comment (now)'), { key: 'Escape' })).toBe(false);
  expect(screen.queryByLabelText('Comment (now)')).toBeNull();
  expect(document.activeElement).toBe(screen.getByRole('button', { name: 'Comment: Tag 7' }));
});

test('a comment written in the past is about the shown moment', async () => {
  person.set(ANNA);
  flush(() => {
    act({ moment: 500 });
  });
  render(<SiteComment />);
  fireEvent.click(screen.getByRole('button', { name: 'Comment: greenhouse' }));
  const field = screen.getByLabelText('Comment (sim 00:08:20)');
  fireEvent.change(field, { target: { value: 'doors open' } });
  fireEvent.click(screen.getByRole('button', { name: 'Save' }));
  await waitFor(() => {
    expect(requests.at(-1)).toBe(
      'POST /api/notes {"kind":"comment","subject":"site","text":"doors open","until":"500.000"}',
    );
  });
});

test('a mark has who commented what on which tag', () => {
  const hidden = 'a\u202ecod';
  standingNotes.set(
    standing([said('n', 500, { text: hidden }), said('s', 90, { subject: 'site' })]),
  );
  render(<NoteMarks span={{ from: 0, to: 1_000 }} tagIds={['8']} />);
  expect(screen.getAllByRole('button').map((it) => it.textContent)).toEqual([
    'anna, sim 00:01:30, greenhouse: s',
  ]);
  render(<NoteMarks span={{ from: 0, to: 1_000 }} tagIds={['7']} />);
  expect(screen.getAllByRole('button').at(-1)?.textContent).toBe(
    'anna, sim 00:08:20, Tag 7: a\ufffdcod',
  );
});

test('a mark has who acknowledged or shelved an alarm when; the card lists comments alone', () => {
  receive({ alarms: alarms([alarm('cold')]) });
  const subject = `alarm:${alarm('cold').id}`;
  standingNotes.set(
    standing([
      said('c', 900, { kind: 'shelve', subject, text: '' }),
      said('b', 500, { kind: 'shelve', subject, text: 'vents', until: 900 }),
      said('a', 90, { kind: 'acknowledge', subject, text: '' }),
    ]),
  );
  render(<NoteMarks span={{ from: 0, to: 1_000 }} />);
  const name = alarm('cold').tag_id;
  expect(screen.getAllByRole('button').map((it) => it.textContent)).toEqual([
    `anna, sim 00:01:30, alarm at Tag ${name}: acknowledged`,
    `anna, sim 00:08:20, alarm at Tag ${name}: shelved until sim 00:15:00: vents`,
    `anna, sim 00:15:00, alarm at Tag ${name}: no longer shelved`,
  ]);
  render(<Comments subject={subject} name="alarm" />);
  expect(screen.queryByTestId('comments')).toBeNull();
});
