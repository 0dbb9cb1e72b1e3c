import { act, fireEvent, render, screen } from '@testing-library/react';
import { expect, onTestFinished, test } from 'vitest';

import { calling } from '../alarms/list';
import { acknowledgeAlarms, NO_LOCAL_ALARMS, own, shelveAlarms } from '../alarms/own';
import { alarmList, startAlarms } from '../alarms/watch';
import { act as look, receive, store } from '../store/app';
import { NO_HOUSE, withPast } from '../store/twin';
import { started } from '../testing/life';
import { alarm, alarms, reportAlarms } from '../testing/alarms';
import { held, judgement, reason } from '../testing/health';
import { goLive, goLost, nextStamp, showTags, status } from '../testing/page';
import { readings, wireTag } from '../testing/tags';
import { AttentionList } from './AttentionList';
import { HealthStrip } from './DoNow';
import { HealthSummary } from './HealthSummary';

const house = (): HTMLElement => screen.getByTestId('greenhouse-health');
const driver = (): HTMLElement => screen.getByTestId('health-driver');
const TAGS = ['1', '5'].map((tag_id) => wireTag({ tag_id }));

test('names the verdict, the tag that it comes from, and why', () => {
  const co2 = reason({ sensor: 'co2', value: 4000, limit: 3000 });
  showTags(TAGS, judgement({ 1: 'healthy', 5: [co2] }));
  render(<HealthSummary kiosk={false} />);
  expect(house().dataset['health']).toBe('critical');
  expect(screen.getByRole('heading').textContent).toBe('Greenhouse status: Critical');
  expect(driver().textContent).toBe('Tag 5: CO₂ 4,000\u00a0ppm, above 3,000');
  fireEvent.click(driver());
  expect(store.get().view.selected).toBe('5');
});

test('says what to do first, and since when', () => {
  const cold = reason({ value: 6, limit: 10 });
  const pest = reason({ kind: 'pest', sensor: '', value: 2, limit: null });
  const few = { ...pest, value: 0 };
  showTags(TAGS, judgement({ 1: [few], 5: [pest] }));
  onTestFinished(started(startAlarms));
  render(<HealthSummary kiosk={false} />);
  act(() => {
    receive({ alarms: alarms([], { source: 'starting' }) });
  });
  expect(house().textContent).not.toContain('no alarm yet');
  act(() => {
    reportAlarms(alarm('a', { tag_id: '5', raised: 100, reason: pest }));
  });
  const todo = screen.getByRole('list', { name: 'Do this now' });
  expect([...todo.children].map(({ textContent }) => textContent)).toEqual([
    expect.stringMatching(
      /^CriticalTag 5: 2 pests seenInspect and treat the plants also tag 1 since /,
    ),
  ]);
  act(() => {
    acknowledgeAlarms(calling(alarmList.get()));
  });
  // At equal severity, unacknowledged comes first.
  expect([...todo.children].map(({ textContent }) => textContent)).toEqual([
    // A single inspection raises an alarm; none is awaited.
    'CriticalTag 1: Pest seenInspect and treat the plants ',
    expect.stringMatching(/^CriticalTag 5: .*treat the plants acknowledged/),
  ]);
  // Never before something worse, for one tag or many; values back in range come last. A first failed
  // scan asks for nothing.
  const back = reason({ verdict: 'stressed', value: 18.1, limit: 18, ...held(18.5) });
  const failed = reason({ kind: 'scan_failed', verdict: 'unknown', sensor: '', value: 1 });
  const tags = ['1', '2', '5'].map((tag_id) => wireTag({ tag_id }));
  act(() => {
    showTags(
      tags,
      judgement({ 1: [back], 2: [failed], 5: [pest, { ...cold, verdict: 'stressed' }] }),
    );
    reportAlarms(alarm('a', { tag_id: '5', raised: 100, reason: pest }));
  });
  expect([...todo.children].map(({ textContent }) => textContent)).toEqual([
    expect.stringMatching(/^CriticalTag 5: 2 pests seen.* acknowledged$/),
    expect.stringMatching(/^StressedTag 5: Temperature .* no alarm yet\+ 1 more$/),
  ]);
});

test('a damp spell at a tag is one task, from its first alarm on; what failed while the past is read counts', () => {
  const humid = reason({ sensor: 'humidity', verdict: 'stressed', value: 93, limit: 85 });
  const vpd = reason({ sensor: 'vpd', verdict: 'stressed', value: 0.15, limit: 0.2 });
  const margin = reason({ ...vpd, sensor: 'condensation_margin', value: 1.1, limit: 1.5 });
  const failed = reason({ kind: 'scan_failed', verdict: 'unknown', sensor: '', value: 1 });
  showTags(TAGS, judgement({ 1: [failed], 5: [humid, vpd, margin] }));
  onTestFinished(started(startAlarms));
  render(<HealthSummary kiosk={false} />);
  const tasks = () =>
    [...screen.getByRole('list', { name: 'Do this now' }).children].map((it) => it.textContent);
  const air = 'Air too damp: Dew margin 1.1\u00a0K, VPD 0.15\u00a0kPa, Humidity 93.0\u00a0%';
  act(() => {
    receive({ alarms: alarms([], { source: 'starting' }) });
  });
  expect(tasks()).toEqual([
    `StressedTag 5: ${air}Ventilate and heat `,
    'UnknownTag 1: Last scan failed: not reachableCheck the path and the tag ',
  ]);
  act(() => {
    const at = { tag_id: '5' };
    reportAlarms(
      alarm('rh', { ...at, raised: 200, reason: humid }),
      alarm('vpd', { ...at, raised: 100, reason: vpd }),
    );
  });
  expect(tasks()).toEqual([
    expect.stringMatching(`^StressedTag 5: ${air}Ventilate and heat since sim 00:01:40$`),
  ]);
});

test('nobody is called for what is shelved, and all the rest is counted', () => {
  const tags = ['1', '2', '3', '4', '5'].map((tag_id) => wireTag({ tag_id }));
  const mild = reason({ verdict: 'stressed' });
  const failed = reason({ kind: 'scan_failed', verdict: 'unknown', sensor: '', value: 1 });
  const pest = reason({ kind: 'pest', verdict: 'stressed', sensor: '', value: 2, limit: null });
  showTags(tags, judgement({ 1: [reason()], 2: [mild], 3: [mild], 4: [pest], 5: [failed] }));
  onTestFinished(started(startAlarms));
  render(<HealthSummary kiosk={false} />);
  const todo = screen.getByRole('list', { name: 'Do this now' });
  act(() => {
    reportAlarms(alarm('fan', { tag_id: '1' }), alarm('far', { tag_id: '5', reason: failed }));
  });
  expect(todo.textContent).toMatch(
    /^CriticalTag 1: .*also tags Stressed 2, 3 .*StressedTag 4: .*\+ 1 more$/,
  );
  // Alarms have their own count beside the table: this button leads to the tags that it counts.
  look({ list: 'alarms' });
  fireEvent.click(screen.getByRole('button', { name: '+ 1 more' }));
  expect(store.get().view.list).toBe('tags');
  expect(house().textContent).not.toContain('Shelved');
  act(() => {
    shelveAlarms(calling(alarmList.get()).slice(0, 1), 15, 'fan');
  });
  expect(todo.textContent).toMatch(/^StressedTag 4: .*StressedTag 2: .*also tag 3 .*\+ 1 more$/);
  fireEvent.click(screen.getByRole('button', { name: '+ 1 more' }));
  expect(store.get().view.list).toBe('tags');
  // Heading and counts include the shelved one, so its omission here is stated.
  fireEvent.click(screen.getByRole('button', { name: 'Shelved (1)' }));
  expect(store.get().view.list).toBe('alarms');
  act(() => {
    showTags(tags, judgement({ 1: [reason()] }));
    reportAlarms(alarm('fan', { tag_id: '1' }));
  });
  expect(todo.textContent).toBe('');
  expect(screen.getByRole('button', { name: 'Shelved (1)' })).toBeTruthy();
});

test('that it is too cold is not shelved with that it was too warm', () => {
  const warm = reason({ verdict: 'critical', value: 40, limit: 35 });
  showTags(TAGS, judgement({ 1: 'healthy', 5: [warm] }));
  onTestFinished(started(startAlarms));
  render(<HealthSummary kiosk={false} />);
  act(() => {
    reportAlarms(alarm('warm', { tag_id: '5', reason: warm }));
    shelveAlarms(calling(alarmList.get()), 15, 'fan');
  });
  const todo = screen.getByRole('list', { name: 'Do this now' });
  expect(todo.textContent).toBe('');
  act(() => {
    showTags(TAGS, judgement({ 1: 'healthy', 5: [reason()] }));
    reportAlarms(alarm('warm', { tag_id: '5', reason: warm }));
  });
  expect(todo.textContent).toMatch(/^CriticalTag 5: Temperature 6.6.*no alarm yet$/);
});

test('of a robot that stands still what is critical is told first', () => {
  const said = judgement({ 1: [reason()], 5: [reason({ value: 5 })] });
  const stopped = reason({ kind: 'stopped', verdict: 'unknown', sensor: '', value: null });
  showTags(TAGS, { ...said, house: { ...said.house, reasons: [stopped] } });
  render(<HealthSummary kiosk={false} />);
  const todo = screen.getByRole('list', { name: 'Do this now' });
  expect([...todo.children].map(({ textContent }) => textContent)).toEqual([
    expect.stringMatching(/^CriticalTag 5: .*also tag 1 /),
    expect.stringMatching(/^No tag is being scanned.* Check the robot$/),
  ]);
});

test('a value that is too old says its age, and an attempt that of the last one', () => {
  const at = nextStamp() - 2_410;
  const cold = wireTag({ tag_id: '5', readings: readings({ temperature: 6.6 }, at) });
  const old = { kind: 'old', verdict: 'unknown', sensor: '', value: null } as const;
  const failed = reason({ kind: 'scan_failed', verdict: 'unknown', sensor: '', value: 1 });
  const attempt = { last_try: at + 2_340, last_try_status: 1 };
  const tags = [cold, wireTag({ tag_id: '6', ...attempt })];
  showTags(tags, judgement({ 5: [reason(), reason(old)], 6: [failed] }));
  reportAlarms(alarm('far', { tag_id: '6', reason: failed }));
  onTestFinished(started(startAlarms));
  render(<HealthSummary kiosk={false} />);
  const todo = screen.getByRole('list', { name: 'Do this now' });
  expect([...todo.children].map(({ textContent }) => textContent)).toEqual([
    expect.stringMatching(
      /^CriticalTag 5: Temperature 6.6\u00a0°C \(40\u00a0min ago\), below 10.0Heat/,
    ),
    expect.stringMatching(/^UnknownTag 6: Last scan failed: not reachable, 1\u00a0min ago/),
  ]);
  // Of a silent twin, each value is one of then.
  act(() => {
    showTags([cold], judgement({ 5: [reason()] }));
    goLost();
  });
  // It comes first, and what to do about a last known value is no instruction for now.
  expect([...todo.children].map(({ textContent }) => textContent)).toEqual([
    expect.stringMatching(/^No current data from the twin Check the twin/),
    expect.stringMatching(
      /^CriticalTag 5: Temperature 6.6\u00a0°C \(40\u00a0min ago\), below 10.0 $/,
    ),
  ]);
});

test('what is back in its range is to be watched', () => {
  const back = reason({ verdict: 'stressed', value: 18.1, limit: 18, ...held(18.5) });
  showTags(TAGS, judgement({ 1: 'healthy', 5: [back] }));
  render(<HealthSummary kiosk={false} />);
  const todo = screen.getByRole('list', { name: 'Do this now' });
  expect(todo.textContent.trim()).toBe(
    'StressedTag 5: Temperature 18.1\u00a0°C, not yet above 18.5Keep an eye on it',
  );
});

test('of tags that need the same done the worst stands for all, some by name', () => {
  const ids = ['1', '2', '3', '4', '5'];
  const all = Object.fromEntries(ids.map((id) => [id, [reason({ value: Number(id) })]]));
  const humid = reason({ verdict: 'stressed', sensor: 'humidity', value: 90, limit: 80 });
  const tags = [...ids, '6'].map((tag_id) => wireTag({ tag_id }));
  showTags(tags, judgement({ ...all, 6: [humid] }));
  const { unmount } = render(<HealthSummary kiosk={false} />);
  const todo = screen.getByRole('list', { name: 'Do this now' });
  expect([...todo.children].map(({ textContent }) => textContent)).toEqual([
    expect.stringMatching(
      /^CriticalTag 1: .*Heat, or close the vents also tags 2, 3, 4 and 1 more $/,
    ),
    expect.stringMatching(/^StressedTag 6: Humidity/),
  ]);
  // Less severe tags follow their own mark.
  const mild = [reason({ verdict: 'stressed', value: 12, limit: 18 })];
  act(() => {
    showTags(tags, judgement({ ...all, 3: mild, 4: mild, 5: mild }));
  });
  expect(todo.textContent).toMatch(
    /Heat, or close the vents also tags 2, Stressed 3, 4 and 1 more $/,
  );
  act(() => {
    showTags(tags, judgement({ ...all, 6: [humid] }));
  });
  // A past moment names them too, but not what to do.
  act(() => {
    const { latest } = store.get().twin;
    look({ moment: 500 });
    receive(withPast({ at: 500, house: latest }));
  });
  expect(todo.textContent).toMatch(/^CriticalTag 1: [^H]* also tags 2, 3, 4 and 1 more /);
  act(() => {
    look({ moment: null });
  });
  unmount();
  render(<HealthSummary kiosk />);
  expect(screen.queryByTestId('health-driver')).toBeNull();
});

test('counts the tags by verdict, and filters by one', () => {
  showTags(TAGS, judgement({ 1: 'healthy', 5: 'unknown' }));
  render(<HealthSummary kiosk={false} />);
  const healthy = screen.getByRole('button', { name: /^1 Healthy/ });
  fireEvent.click(healthy);
  expect(store.get().view.health).toBe('healthy');
  expect(healthy.getAttribute('aria-pressed')).toBe('true');
  fireEvent.click(healthy);
  expect(store.get().view.health).toBeNull();
  const many = Array.from({ length: 1200 }, (_, id) => String(id));
  act(() => {
    showTags(
      many.map((tag_id) => wireTag({ tag_id })),
      judgement(Object.fromEntries(many.map((id) => [id, 'unknown']))),
    );
  });
  expect(screen.getByRole('button', { name: /^1,200 Unknown/ })).toBeTruthy();
});

test('all is well, hardly anything is known, and nothing is', () => {
  showTags(TAGS, judgement({ 1: 'healthy', 5: 'healthy' }));
  render(<HealthSummary kiosk={false} />);
  expect(driver().textContent).toMatch(/^All assessed readings/);
  const few = judgement({ 1: 'unknown', 5: 'unknown' });
  act(() => {
    showTags(TAGS, few);
  });
  expect(house().dataset['health']).toBe('unknown');
  expect(driver().textContent).toMatch(/^More than half/);
  // A tag with only old readings waits for the robot.
  const failed = reason({ kind: 'scan_failed', verdict: 'unknown', sensor: '', value: 1 });
  const old = { ...failed, kind: 'old' } as const;
  act(() => {
    showTags(TAGS, judgement({ 1: 'healthy', 5: [old] }));
  });
  expect(driver().textContent).toBe('1 tag cannot be assessed');
  // So does one whose scan has failed once; an alarm is named with its tag, even if readings are old too.
  act(() => {
    showTags(TAGS, judgement({ 1: 'healthy', 5: [failed, old] }));
  });
  expect(driver().textContent).toBe('1 tag cannot be assessed');
  onTestFinished(started(startAlarms));
  act(() => {
    reportAlarms(alarm('far', { tag_id: '5', reason: failed }));
  });
  expect(driver().textContent).toMatch(/^Tag 5: Last scan failed: not reachable/);
  act(() => {
    showTags([]);
  });
  expect(driver().textContent).toMatch(/^No reading/);
});

test('beside an active alarm, healthy says why', () => {
  showTags(TAGS, judgement({ 1: 'healthy', 5: 'healthy' }));
  onTestFinished(started(startAlarms));
  own.set(NO_LOCAL_ALARMS);
  render(<HealthSummary kiosk={false} />);
  act(() => {
    reportAlarms(alarm('a'));
  });
  expect(house().dataset['health']).toBe('healthy');
  expect(driver().textContent).toBe(
    '1 alarm is still active: the next good scan or inspection resolves it',
  );
  // A shelved one is not called active, but counted.
  act(() => {
    shelveAlarms(calling(alarmList.get()), 15, 'fan');
  });
  expect(driver().textContent).toMatch(/^All assessed readings/);
  expect(screen.getByRole('button', { name: 'Shelved (1)' })).toBeTruthy();
  act(() => {
    reportAlarms(alarm('a', { cleared: 950 }));
  });
  expect(driver().textContent).toMatch(/^All assessed readings/);
});

test('a silent greenhouse is unknown, whatever its last verdict', () => {
  showTags(TAGS, judgement({ 1: 'healthy', 5: 'healthy' }));
  goLost();
  render(<HealthSummary kiosk={false} />);
  expect(house().dataset['health']).toBe('unknown');
  expect(driver().textContent).toMatch(/^No current data .* Check the twin, the server/);
  // "Not current" is not "unknown": the tags' last statuses still count.
  expect(screen.getByRole('heading').textContent).toBe('Greenhouse status: Not current');
  expect(screen.getByRole('button', { name: /^2 Healthy/ })).toBeTruthy();
});

test('a twin without a valid time is not silent: nothing is assessed, and the banner says what to do', () => {
  showTags(TAGS, judgement({ 1: 'unknown', 5: 'unknown' }));
  goLive(status({ twin: 'offline', reason: 'clock_doubted' }));
  render(<HealthSummary kiosk={false} />);
  expect(screen.getByRole('heading').textContent).toBe('Greenhouse status: Unknown');
  expect(driver().textContent).toBe('Not assessed while the time is unknown');
});

test('what had to be done stays when the twin is not heard any more; of when, the banner says', () => {
  showTags(TAGS, judgement({ 1: 'healthy', 5: [reason()] }));
  render(<HealthSummary kiosk={false} />);
  act(goLost);
  const todo = screen.getByRole('list', { name: 'Do this now' });
  expect([...todo.children].map(({ textContent }) => textContent)).toEqual([
    expect.stringMatching(/^No current data from the twin/),
    expect.stringMatching(/^CriticalTag 5: .*below 10.0 $/),
  ]);
});

test('while a moment loads nothing is said of it, and nothing is counted', () => {
  showTags(TAGS, judgement({ 1: 'healthy', 5: [reason()] }));
  act(() => {
    look({ moment: 500 });
    receive(withPast({ at: 500, house: NO_HOUSE }));
  });
  render(
    <>
      <HealthSummary kiosk={false} />
      <HealthStrip />
      <AttentionList />
    </>,
  );
  expect(screen.getByRole('heading').textContent).toBe('Greenhouse status: ');
  expect(screen.getByTestId('greenhouse-health').dataset).not.toHaveProperty('health');
  for (const each of screen.getAllByRole('list', { name: 'Do this now' })) {
    expect(each.textContent).toBe('');
  }
  for (const each of screen.getAllByRole('button')) expect(each.textContent).toMatch(/^– /);
});

test.each([
  [true, 'light', 'Day ranges apply: by the light measured'],
  [false, 'clock', 'Night ranges apply: by the clock, as no light'],
  [true, 'assumed', 'Day ranges apply: assumed'],
] as const)('whose ranges hold is said: day %s, by %s', (is_day, source, expected) => {
  showTags(TAGS, judgement({}, { is_day, source }));
  render(<HealthSummary kiosk={false} />);
  expect(screen.getByRole('heading').title).toContain(expected);
});
