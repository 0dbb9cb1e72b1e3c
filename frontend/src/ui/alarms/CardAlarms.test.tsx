import { act as flush, fireEvent, render, screen } from '@testing-library/react';
import { afterEach, beforeEach, expect, test } from 'vitest';

import { acknowledgeAlarms, NO_LOCAL_ALARMS, own, shelveAlarms } from '../../alarms/own';
import { alarmList, startAlarms } from '../../alarms/watch';
import { act, receive } from '../../store/app';
import { person } from '../../store/create';
import { NO_HOUSE, withPast } from '../../store/twin';
import { started } from '../../testing/life';
import { alarm, reportAlarms } from '../../testing/alarms';
import { held, judgement, reason } from '../../testing/health';
import { goLive, goLost, showTags } from '../../testing/page';
import { readings, wireTag } from '../../testing/tags';
import { Reasons } from '../Reasons';
import { AlarmNotes } from './AlarmNotes';
import { AlarmsLabel } from './ListChoice';
import { CardAlarms } from './CardAlarms';

let stop: () => void;

beforeEach(() => {
  own.set(NO_LOCAL_ALARMS);
  showTags([wireTag({ tag_id: '7' })]);
  stop = started(startAlarms);
  render(<CardAlarms tagId="7" />);
});
afterEach(() => {
  stop();
});

test('a tag without an alarm has nothing to acknowledge', () => {
  flush(() => {
    reportAlarms(alarm('a', { tag_id: '8' }));
  });
  expect(screen.queryByTestId('card-alarms')).toBeNull();
});

test('a tag that is well again says what its alarm still waits for', () => {
  flush(() => {
    const warm = { readings: readings({ temperature: 22 }) };
    showTags([wireTag({ tag_id: '7', ...warm })], judgement({ 7: 'healthy' }));
    reportAlarms(alarm('a', { tag_id: '7' }));
  });
  const line = screen.getByTestId('card-alarms');
  expect(line.textContent).toContain(' · The next good scan resolves it');
});

test('all alarms of a tag are acknowledged where it is looked at, and no others', () => {
  flush(() => {
    reportAlarms(
      alarm('a', { tag_id: '7', raised: 500 }),
      alarm('b', { tag_id: '7', raised: 900, reason: { kind: 'pest', sensor: '' } }),
      alarm('c', { tag_id: '8' }),
    );
  });
  const line = screen.getByTestId('card-alarms');
  expect(line.textContent).toMatch(/^2 alarms · since sim 00:08:20/);
  const vera = { can_sign_out: true, seconds_left: null, name: 'vera', role: 'viewer' } as const;
  flush(() => {
    person.set({ ...vera, can_write_notes: false });
  });
  expect(screen.queryByRole('button')).toBeNull();
  flush(() => {
    person.set({ ...vera, can_write_notes: true });
    goLost();
  });
  expect(screen.getByRole<HTMLButtonElement>('button').disabled).toBe(true);
  flush(() => {
    person.set(null);
  });
  fireEvent.click(screen.getByRole('button', { name: 'Acknowledge all (2)' }));
  expect(line.textContent).toMatch(/^2 alarms acknowledged · since/);
  expect(screen.queryByRole('button')).toBeNull();
  const seen = alarmList.get().active.filter(({ isAcknowledged }) => isAcknowledged);
  expect(seen.map(({ alarm: { id } }) => id).sort()).toEqual(['a', 'b']);
});

test('of one alarm it says who has acknowledged it, and when', () => {
  flush(() => {
    const said = { acknowledged_by: 'vera', acknowledged_at: 950 };
    reportAlarms(alarm('a', { tag_id: '7', ...said }));
    acknowledgeAlarms(alarmList.get().active);
  });
  expect(screen.getByTestId('card-alarms').textContent).toMatch(
    /^1 alarm: acknowledged by vera, sim 00:15:50 · since/,
  );
});

test('of two reasons it is said which waits for a second scan; what the deadband alone holds does not', () => {
  const damp = reason({ sensor: 'humidity', value: 90, limit: 85 });
  const back = reason({ sensor: 'co2', value: 1_450, limit: 1_500, ...held(1_400) });
  render(
    <Reasons health={{ verdict: 'critical', reasons: [reason(), damp, back] }} tagId="7" hasTodo />,
  );
  const lines = (): (string | null)[] =>
    [...screen.getByTestId('reasons').children].map(({ textContent }) => textContent);
  expect(lines().filter((text) => text?.includes('no alarm yet'))).toEqual([]);
  flush(() => {
    reportAlarms(alarm('a', { tag_id: '7' }));
  });
  expect(lines()).toEqual([
    expect.stringMatching(/close the vents $/),
    expect.stringMatching(/^Humidity 90.*no alarm yet$/),
    expect.stringMatching(/^CO₂ 1,450.*CO₂ dosing $/),
  ]);
});

test('what is shelved says until when and why, has its way back, and is no order meanwhile', () => {
  const cold = reason();
  render(<Reasons health={{ verdict: 'critical', reasons: [cold] }} tagId="7" hasTodo />);
  const order = (): string | undefined =>
    screen.getByTestId('reasons').querySelector('strong')?.textContent;
  flush(() => {
    reportAlarms(alarm('a', { tag_id: '7' }), alarm('b', { tag_id: '8' }));
    shelveAlarms(alarmList.get().active, 15, 'fan ordered');
  });
  expect(screen.queryByTestId('card-alarms')).toBeNull();
  expect(screen.getByTestId('card-shelved').textContent).toMatch(
    /^Temperature below 10\.0\u00a0°C: shelved until [\d:]+: fan orderedUnshelve$/,
  );
  expect(order()).toBeUndefined();
  fireEvent.click(screen.getByRole('button', { name: 'Unshelve' }));
  expect(screen.queryByTestId('card-shelved')).toBeNull();
  expect(screen.getByTestId('card-alarms').textContent).toMatch(/^1 alarm · since/);
  expect(order()).toBe('Heat, or close the vents');
});

test('the count of alarms is of all behind the sign of the worst, and none of now where that is not known', () => {
  const { container } = render(<AlarmsLabel />);
  const count = (): string => screen.getByTestId('alarm-count').textContent.trim();
  const sign = (): unknown =>
    container.querySelector<HTMLElement>('.health-mark')?.dataset['health'];
  const bad = ['8', '9'].map((id) => alarm(id, { tag_id: id, reason: { verdict: 'stressed' } }));
  flush(() => {
    reportAlarms(...bad);
  });
  expect([sign(), count()]).toEqual(['stressed', '(2)']);
  flush(() => {
    reportAlarms(...bad, alarm('c', { reason: { verdict: 'critical' } }));
  });
  expect([sign(), count()]).toEqual(['critical', '(3)']);
  // While somebody looks back, a critical alarm of now still calls.
  flush(() => {
    act({ moment: 10 });
  });
  expect([sign(), count()]).toEqual(['critical', '(3 now)']);
  flush(() => {
    acknowledgeAlarms(alarmList.get().active);
  });
  expect([sign(), count()]).toEqual([undefined, '(3 now)']);
  flush(goLost);
  expect(screen.queryByTestId('alarm-count')).toBeNull();
  // Whether an empty list is still empty is unknown.
  flush(() => {
    act({ moment: null });
    reportAlarms();
  });
  expect(container.textContent).toBe('Alarms');
  flush(goLive);
  expect(container.textContent).toBe('Alarms, none active');
});

test('the alarms of a page that looks back are the current ones, as long as anybody knows those', () => {
  render(<AlarmNotes isEmpty={false} />);
  const notes = (): unknown[] =>
    [...document.querySelectorAll<HTMLElement>('[data-note]')].map(
      ({ dataset }) => dataset['note'],
    );
  flush(() => {
    act({ moment: 10 });
    receive(withPast({ at: 10, house: NO_HOUSE }));
  });
  expect(notes()).toEqual(['now']);
  flush(goLost);
  expect(notes()).toEqual(['lost']);
  // The banner gives the time.
  expect(screen.queryByText(/\d\d:\d\d/)).toBeNull();
});
