import { describe, expect, test } from 'vitest';

import { step, INITIAL } from '../connection/machine';
import { status } from '../testing/page';
import { stateFrame, wireTag } from '../testing/tags';
import { changed } from './create';
import { NO_TWIN, withConnection, withState } from './twin';

const late = stateFrame([wireTag({ tag_id: 'a' }), wireTag({ tag_id: 'b' })], { seq: 900 });

describe('state frames', () => {
  test('an old state that the bridge kept is as old as the bridge says', () => {
    const { snapshot } = changed(NO_TWIN, withState(late, 100_000, 40)).latest;
    expect(snapshot?.takenAt).toBe(60_000);
  });

  test('a restarted server counts from one again and is believed', () => {
    const before = changed(NO_TWIN, withState(late, 50));
    const latest = stateFrame([wireTag({ tag_id: 'c' })], { seq: 1, sec: 3, revision: 'new' });
    const after = changed(before, withState(latest, 60));
    expect(after.latest.snapshot?.tags.map(({ id }) => id)).toEqual(['c']);
    expect(after.latest.snapshot?.revision).toBe('new');
  });
});

test('a frame that only moves the clock is no reason to render', () => {
  const open = [
    { type: 'start', now: 0 } as const,
    { type: 'opened', now: 1 } as const,
    { type: 'frame', now: 2, status: status() } as const,
    { type: 'frame', now: 2, status: null } as const,
  ].reduce((connection, event) => step(connection, event, 1).connection, INITIAL);
  const live = changed(NO_TWIN, withConnection(open, 3));
  expect(live.phase).toBe('live');
  const received = step(open, { type: 'frame', now: 100, status: null }, 1).connection;
  expect(changed(live, withConnection(received, 101))).toBe(live);
  const silent = changed(live, withConnection(received, 9_000));
  expect(silent.phase).toBe('stale');
});
