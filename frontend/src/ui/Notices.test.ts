import { beforeEach, describe, expect, test } from 'vitest';

import { act, receive, store } from '../store/app';
import { NO_HOUSE, NO_TWIN, type House, withField, withPast, withState } from '../store/twin';
import { goLive, goLost, showTags, status } from '../testing/page';
import { timelineOf } from '../domain/timeline';
import { readings, snapshot, stateFrame, tag, wireTag } from '../testing/tags';
import { wireTimeline } from '../testing/timeline';
import { noticeFor } from './Notices';

const id = (): string | undefined => noticeFor(store.get())?.id;
const noPose = { position: { x: 0, y: 0, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 0 } };

describe('before the first state', () => {
  const empty = { ...store.get(), twin: NO_TWIN };

  test('connecting, then unreachable, or no twin', () => {
    expect(noticeFor(empty)?.id).toBe('connecting');
    goLost();
    const lost = store.get().twin;
    expect(noticeFor({ ...empty, twin: { ...lost, latest: NO_HOUSE } })?.id).toBe('unreachable');
    goLive(status({ twin: 'offline', reason: 'never_seen' }));
    const offline = { ...store.get().twin, latest: NO_HOUSE };
    expect(noticeFor({ ...empty, twin: offline })?.hint).toMatch(/Is the twin switched on/);
    // Of a fleet's archive that is down, nothing is said of the twin.
    goLive(status({ twin: 'offline', reason: 'never_seen', input_problems: ['it is down'] }));
    const down = { ...store.get().twin, latest: NO_HOUSE };
    expect(noticeFor({ ...empty, twin: down })).toMatchObject({ title: 'No data yet', hint: '' });
  });
});

describe('the most basic problem is shown first', () => {
  beforeEach(() => {
    showTags([wireTag({ readings: readings({ temperature: 20 }) })]);
  });

  test('no tags; a twin that was heard is there, whatever it lacks', () => {
    showTags([]);
    expect(id()).toBe('no-tags');
    // No hint that is untrue without a connection; the banner reports the loss.
    expect(noticeFor(store.get())?.hint).not.toContain('running');
    goLive(status({ twin: 'offline', reason: 'stale' }));
    expect(noticeFor(store.get())).toMatchObject({
      id: 'no-twin',
      title: 'No tags yet',
      hint: expect.stringContaining('has stopped sending') as string,
    });
    // Its data still arrives; the banner says what its clock lacks.
    goLive(status({ twin: 'offline', reason: 'no_clock' }));
    expect(id()).toBe('no-tags');
  });

  test('no pins', () => {
    showTags([wireTag({ pose: noPose, readings: readings({ temperature: 20 }) })]);
    expect(id()).toBe('no-pins');
  });

  test('no reading of the chosen sensor, which is named', () => {
    act({ sensor: 'co2' });
    expect(noticeFor(store.get())).toMatchObject({ id: 'no-reading' });
    expect(noticeFor(store.get())?.title).toContain('CO₂');
  });

  test('no map', () => {
    goLive(status({ has_map: false }));
    expect(id()).toBe('no-map');
  });

  test('a field that could not be loaded, with the server’s reason', () => {
    receive(withField({ value: null, state: 'failed', message: 'too many cells' }));
    expect(noticeFor(store.get())?.title).toContain('too many cells');
    // The banner says why nothing loads without a connection.
    goLost();
    expect(id()).toBeUndefined();
  });

  test('nothing is lacking', () => {
    expect(id()).toBeUndefined();
  });
});

describe('of a moment in the past', () => {
  const at = 5_025;
  const come = (house: House): void => {
    showTags([wireTag({ readings: readings({ temperature: 20 }) })]);
    act({ moment: at });
    receive(withPast({ at, house }));
  };

  test('that has not come, nothing is there yet, whatever there is now', () => {
    come(NO_HOUSE);
    expect(noticeFor(store.get())).toMatchObject({
      id: 'past-fetching',
      title: 'Loading sim 01:23:45',
      large: true,
    });
  });

  test('that cannot be had, the reason is told', () => {
    come(NO_HOUSE);
    receive({ pastFault: { at, message: 'no journal is kept', isLasting: true } });
    expect(noticeFor(store.get())?.hint).toBe('This moment is in the future.');
    receive(withState(stateFrame([wireTag()], { sec: at + 1 }), performance.now()));
    expect(noticeFor(store.get())).toMatchObject({ id: 'past-failed', hint: 'no journal is kept' });
  });

  test('of which , it says since when anything is', () => {
    come({ ...NO_HOUSE, snapshot: snapshot([]) });
    expect(noticeFor(store.get())).toMatchObject({
      id: 'past-nothing',
      hint: 'Nothing has been recorded yet.',
    });
    const value = timelineOf(wireTimeline({ from: 7_200, to: 9_000 }), 9_000);
    receive({ remembered: { value, state: 'ready', message: '' } });
    expect(noticeFor(store.get())?.hint).toBe('Recorded data begins at sim 02:00:00.');
  });

  test('that the journal does not have all of is not said to have been empty', () => {
    come({ ...NO_HOUSE, snapshot: { ...snapshot([]), isWhole: false } });
    const value = timelineOf(wireTimeline({ from: 0, to: 9_000 }), 9_000);
    receive({ remembered: { value, state: 'ready', message: '' } });
    const hint = 'This is no longer stored, or was not recorded yet.';
    expect(noticeFor(store.get())).toMatchObject({ id: 'past-nothing', hint });
    // Its tags have positions, but their scans were deleted.
    come({ ...NO_HOUSE, snapshot: { ...snapshot([tag()]), isWhole: false } });
    expect(noticeFor(store.get())).toMatchObject({ id: 'past-nothing', hint, large: false });
  });

  test('with tags there is nothing to say', () => {
    come({
      ...NO_HOUSE,
      snapshot: snapshot([tag({ readings: readings({ temperature: 20 }) })]),
    });
    expect(id()).toBeUndefined();
  });
});
