import { act as flush, render, screen } from '@testing-library/react';
import { beforeEach, expect, test } from 'vitest';

import type { Journal } from '../contract/types';
import { act, receive } from '../store/app';
import { NO_HOUSE, withPast, withUnread } from '../store/twin';
import { goLive, showTags, status } from '../testing/page';
import { deferred } from './loadDeferred';
import { Troubles } from './Troubles';

beforeEach(() => {
  showTags([]);
});

const lines = (): string[] =>
  [...screen.getByTestId('troubles').querySelectorAll(':scope > div')].map(
    (line) => line.textContent,
  );

test('messages that could not be read are counted, and the last is named', () => {
  render(<Troubles />);
  expect(lines()).toEqual([]);
  flush(() => {
    receive(withUnread('state.seq: is missing'));
  });
  expect(lines()).toEqual([
    'A message from the server could not be read and was dropped. More about thisState.seq: is missing. ',
  ]);
  flush(() => {
    receive(withUnread('a message that is no JSON'));
  });
  expect(lines()[0]).toMatch(/^2 messages .* More about thisA message that is no JSON\. $/);
  flush(() => {
    receive({ unread: null });
  });
  expect(lines()).toEqual([]);
});

test('a part of the page that has not arrived is reported', () => {
  render(<Troubles />);
  flush(() => {
    deferred.set({ parts: null, isLate: true });
  });
  expect(lines()).toEqual([expect.stringMatching(/^Part of the page has not loaded\. Cards/)]);
  flush(() => {
    deferred.set({ parts: null, isLate: false });
  });
  expect(lines()).toEqual([]);
});

test('what the twin dropped is reported with its count, and a pause as one', () => {
  goLive(
    status({
      reason: 'paused',
      drops: [{ reason: 'frame', message: 'frame odom, expected map', count: 12 }],
    }),
  );
  render(<Troubles />);
  expect(lines()).toEqual([
    'Time is paused. The simulation or recording is paused, so ages do not increase.',
    'The twin dropped 12 messages in the last few minutes. More about thisFrame odom, expected map. ',
  ]);
});

test('a mixture of two twins is told, for nothing of it is to be relied on', () => {
  goLive(status({ twin_count: 2 }));
  render(<Troubles />);
  expect(lines()).toEqual([expect.stringMatching(/^More than one twin sends data\. /)]);
});

test('what the twin does not hear is told with the remedy, to its end', () => {
  const why = `/a_node publishes ${'/long'.repeat(60)} as VOLATILE`;
  goLive(status({ input_problems: [`${why}; use TRANSIENT_LOCAL`, 'nothing has come yet.'] }));
  render(<Troubles />);
  expect(lines()).toEqual([
    `Some data does not arrive. More about this${why}; use TRANSIENT_LOCAL. Nothing has come yet. `,
  ]);
});

test('a recording stands still because it is paused, or over', () => {
  goLive(status({ reason: 'paused', origin: 'recorded' }));
  render(<Troubles />);
  expect(lines()).toEqual([
    'The recording is paused. It is paused or has ended, so ages do not increase.',
  ]);
});

const recording: Journal = {
  state: 'recording',
  detail: 'recording',
  set_aside: '',
  simulated: null,
};
const journal = (over: Partial<Journal>): void => {
  flush(() => {
    goLive(status({ journal: { ...recording, ...over } }));
  });
};

test.each([
  // Not every failure is a full disk: some ask for a restart of the twin, in their own words.
  [
    'failing',
    'Recording has failed.',
    /If the disk is full, free space; if it is read-only, make it writable/,
  ],
  ['slow', 'Recording has fallen behind.', /Data waits in memory/],
  ['upgrading', 'The recording of an older version is being upgraded.', /which may take minutes/],
  [
    'in_use',
    'This twin is not recording: another twin uses its file.',
    /Stop one of them, or give/,
  ],
  ['foreign', 'This twin is not recording: it cannot read its file.', /Give the twin another file/],
  ['off', 'Recording is off.', /A restart loses all earlier data/],
] as const)('a journal that is %s is reported, with why and what to do', (state, title, hint) => {
  render(<Troubles />);
  journal({ state, detail: 'database or disk is full' });
  expect(lines()).toHaveLength(1);
  expect(lines()[0]).toContain(title);
  expect(lines()[0]).toMatch(hint);
  // In the twin's words, for whoever maintains it: they are English on a page of any language.
  const cause = screen.getByText('Database or disk is full.');
  expect(cause.lang).toBe('en');
  expect(cause.closest('details')?.open).toBe(false);
  // It clears by itself.
  journal({});
  expect(lines()).toEqual([]);
});

test('a journal that does well, starts, or is not told of is no trouble, nor what the banner says', () => {
  render(<Troubles />);
  for (const state of ['recording', 'starting', 'unknown', 'doubting'] as const) {
    journal({ state });
    expect(lines()).toEqual([]);
  }
  // Nor is a state that this page does not know yet.
  journal({ state: 'constructor' as Journal['state'] });
  expect(lines()).toEqual([]);
});

test('a quarantined journal is reported by its name', () => {
  render(<Troubles />);
  journal({ set_aside: '/home/x/j.sqlite.damaged-20261121T141500Z' });
  expect(lines()).toEqual([
    'A damaged recording was quarantined. Readable data was kept, and recording continues. ' +
      'The damaged file is /home/x/j.sqlite.damaged-20261121T141500Z.',
  ]);
});

test.each([
  ['mqtt', 'Home automation (MQTT) receives no updates. '],
  ['webhook', 'The webhook receives no alarms. '],
  ['push', 'Phones receive no alarms. '],
  ['constructor', 'constructor receives no updates. '],
])('that %s does not reach its receiver is reported until it does', (channel, title) => {
  render(<Troubles />);
  const outward = (isFailing: boolean, detail: string): void => {
    flush(() => {
      goLive(status({ outward: [{ channel: channel as 'mqtt', is_failing: isFailing, detail }] }));
    });
  };
  outward(false, '');
  expect(lines()).toEqual([]);
  outward(true, 'connection refused (mqtt://broker.lan:1883)');
  expect(lines()).toEqual([
    `${title}The server keeps trying. This page is not affected.` +
      'More about thisConnection refused (mqtt://broker.lan:1883). ',
  ]);
  outward(true, 'no answer within 10 s');
  expect(lines()[0]).toContain('No answer within 10 s.');
  outward(false, '');
  expect(lines()).toEqual([]);
});

test('a moment that could not be loaded, and which one is shown instead', () => {
  receive(withPast({ at: 5_025, house: NO_HOUSE }));
  act({ moment: 3_600 });
  receive({ pastFault: { at: 3_600, message: 'too busy', isLasting: false } });
  render(<Troubles />);
  expect(lines()).toEqual([
    'sim 01:00:00 could not be loaded (too busy). Showing sim 01:23:45 while the page retries.',
  ]);
});
