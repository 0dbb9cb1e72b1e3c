import { act as flush, fireEvent, render, screen, within } from '@testing-library/react';
import { beforeEach, describe, expect, test } from 'vitest';

import { act, prefer, receive, store } from '../store/app';
import { judgement, reason } from '../testing/health';
import { hourAgo } from '../store/hourAgo';
import { goLive, goLost, showTags, status } from '../testing/page';
import { readings, tag, wireTag } from '../testing/tags';
import { TagTable } from './TagTable';

const noPose = { position: { x: 0, y: 0, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 0 } };

beforeEach(() => {
  const said = judgement({
    2: 'unknown',
    9: [reason({ kind: 'reading_failed', verdict: 'stressed', sensor: 'humidity', value: null })],
    10: [reason({ value: 40, limit: 35 })],
  });
  const tags = [
    wireTag({
      tag_id: '9',
      readings: readings({ temperature: 20, humidity: null }),
      species: 'rose',
      species_confidence: 0.91,
    }),
    wireTag({
      tag_id: '10',
      readings: readings({ temperature: 40, co2: 700 }),
      anomaly: true,
      bug_count: 2,
    }),
    wireTag({ tag_id: '2', pose: noPose, stale_seconds: null }),
  ];
  showTags(tags, said);
});

const row = (id: string): HTMLElement => {
  const found = document.querySelector<HTMLElement>(`tr[data-tag-id="${id}"]`);
  if (!found) throw new Error(`no row ${id}`);
  return found;
};
const order = (): (string | undefined)[] =>
  [...document.querySelectorAll<HTMLElement>('tbody tr')].map((each) => each.dataset['tagId']);
const head = (name: RegExp): HTMLElement => screen.getByRole('columnheader', { name });
const press = (name: RegExp): void => {
  fireEvent.click(within(head(name)).getByRole('button'));
};

describe('table', () => {
  test('lists every tag, also one without a pin that nobody observed', () => {
    render(<TagTable />);
    // The worst first.
    expect(order()).toEqual(['10', '9', '2']);
    expect(row('2').dataset['pinned']).toBe('false');
    expect(row('2').textContent).toContain('No pin');
    expect(row('2').textContent).toContain('never');
  });

  test('says why a tag with readings is unknown, unless nothing is assessed at all', () => {
    const tags = ['9', '10'].map((tag_id) =>
      wireTag({ tag_id, readings: tag_id === '9' ? readings({ ph: 6 }) : [] }),
    );
    showTags(tags, judgement({ 9: 'unknown', 10: 'unknown' }));
    render(<TagTable />);
    expect(row('9').querySelector('.why')?.textContent).toBe('No reading with an ideal range');
    // Its age says "never".
    expect(row('10').querySelector('.why')).toBeNull();
    flush(() => {
      goLive(status({ twin: 'offline', reason: 'no_clock' }));
    });
    expect(row('9').querySelector('.why')).toBeNull();
  });

  test('says first what the verdict is about, then that an attempt has failed', () => {
    const failed = reason({ kind: 'scan_failed', verdict: 'unknown', sensor: '', value: 2 });
    const hot = reason({ verdict: 'critical', value: 40, limit: 35 });
    const last = { last_try: 20, last_try_status: 2, last_try_detail: '' };
    const tags = ['9', '10'].map((tag_id) =>
      wireTag({ tag_id, readings: readings({ temperature: 40 }), ...last }),
    );
    showTags(tags, judgement({ 9: [hot, failed], 10: [failed] }));
    render(<TagTable />);
    expect(row('9').querySelector('.why')?.textContent).toMatch(
      /^Temperature .*; Last scan failed: not readable, /,
    );
    expect(row('10').querySelector('.why')?.textContent).toMatch(
      /^Last scan failed: not readable, /,
    );
  });

  test('no row moves below a pointer, and all do once it has left', () => {
    render(<TagTable />);
    const body = row('2').parentElement ?? document.body;
    fireEvent.pointerEnter(body);
    flush(() => {
      showTags(
        ['2', '9', '10'].map((tag_id) => wireTag({ tag_id })),
        judgement({ 2: [reason({})] }),
      );
    });
    expect(row('2').dataset['health']).toBe('critical');
    expect(order()).toEqual(['10', '9', '2']);
    fireEvent.pointerLeave(body);
    expect(order()).toEqual(['2', '9', '10']);
  });

  test('shows readings, a failed sensor, species with confidence, pest and health', () => {
    render(<TagTable />);
    const cell = (id: string, sensor: string): string =>
      row(id).querySelector(`[data-sensor="${sensor}"] .reading`)?.textContent ?? '';
    expect(cell('9', 'temperature')).toBe('20.0');
    expect(cell('9', 'humidity')).toBe('failed');
    // Blank to the eye: `.unseen`.
    expect(cell('9', 'co2')).toBe('No sensor');
    expect(cell('10', 'temperature')).toBe('high Temperature above 35.0\u00a0°C: 40.0');
    expect(row('9').textContent).toContain('Rose91');
    // Below the name where the column has no room; without a species there is nothing to say.
    const below = ['9', '10'].map((id) => row(id).querySelector('.row-species')?.textContent);
    expect(below).toEqual(['Rose', undefined]);
    expect(row('10').dataset['health']).toBe('critical');
    expect(row('2').dataset['health']).toBe('unknown');
    const why = row('9').querySelector('.cell-health');
    expect(why?.getAttribute('title')).toBe('Humidity: the sensor returns no value');
    expect(why?.textContent).toBe('Stressed: Humidity: the sensor returns no value');
  });

  test('a reading of an earlier scan than the others has its own age', () => {
    const taken = { temperature: 100, humidity: 41, co2: 39 };
    const all = Object.entries(taken).flatMap(([name, sec]) => readings({ [name]: 20 }, sec));
    showTags([wireTag({ readings: all })]);
    render(<TagTable />);
    const aged = [...row('1').querySelectorAll('[data-sensor]:has(.own-age)')];
    expect(aged.map((each) => each.getAttribute('data-sensor'))).toEqual(['co2']);
  });

  test('sorts by a column, up and down, and says so', () => {
    render(<TagTable />);
    expect(head(/^Status/).getAttribute('aria-sort')).toBe('descending');
    press(/^Temperature/);
    expect(head(/^Temperature/).getAttribute('aria-sort')).toBe('ascending');
    expect(head(/^Tag/).getAttribute('aria-sort')).toBe('none');
    expect(order()).toEqual(['9', '10', '2']);
    press(/^Temperature/);
    expect(head(/^Temperature/).getAttribute('aria-sort')).toBe('descending');
    expect(order()).toEqual(['10', '9', '2']);
  });

  test('a click anywhere in a row chooses its tag, a second one lets go', () => {
    render(<TagTable />);
    fireEvent.click(row('9').lastElementChild ?? row('9'));
    expect(store.get().view.selected).toBe('9');
    expect(row('9').dataset['selected']).toBe('true');
    fireEvent.click(within(row('9')).getByRole('button', { pressed: true }));
    expect(store.get().view.selected).toBeNull();
  });

  test('a row under the pointer is hovered, as its pin then is', () => {
    render(<TagTable />);
    fireEvent.pointerOver(row('10'));
    expect(store.get().view.hovered).toBe('10');
    expect(row('10').dataset['hovered']).toBe('true');
    fireEvent.pointerLeave(screen.getByRole('table'));
    expect(store.get().view.hovered).toBeNull();
  });

  test('its first column has room for the longest name, and for the species below it', () => {
    render(<TagTable />);
    const column = document.querySelector<HTMLElement>('.col-tag');
    expect(column?.style.getPropertyValue('--letters')).toBe('2');
    expect(column?.style.getPropertyValue('--species')).toBe('4');
  });

  test('a filter that finds nothing offers the way out', () => {
    act({ filter: 'nobody' });
    render(<TagTable />);
    expect(order()).toEqual([undefined]);
    fireEvent.click(screen.getByRole('button', { name: 'Clear filter' }));
    expect(order()).toHaveLength(3);
  });

  test('temperatures follow the chosen unit', () => {
    prefer({ unit: 'F' });
    render(<TagTable />);
    // Short on screen, full for screen readers.
    expect(head(/^Temperature/).textContent).toBe('Temp.Temperature °F');
    expect(row('9').querySelector('[data-sensor="temperature"] .reading')?.textContent).toBe(
      '68.0',
    );
  });

  const trends = (): (string | null)[] =>
    [...document.querySelectorAll('.chosen > :is(.trend, .unseen)')].map(
      (each) => each.textContent,
    );
  const tags = [
    wireTag({ tag_id: 'a', readings: readings({ temperature: 22 }) }),
    wireTag({ tag_id: 'b', readings: readings({ temperature: 20 }) }),
    wireTag({ tag_id: 'c', readings: readings({ co2: 500 }) }),
  ];

  test('the sensor in view has its trend, or why there is none', () => {
    const health = judgement({ a: [reason({ verdict: 'stressed' })], b: 'healthy', c: 'healthy' });
    showTags(tags, health);
    render(<TagTable />);
    expect(trends()).toEqual(['an hour ago: unknown', 'an hour ago: unknown']);
    // Hidden text takes no room: the value stays centred in its row.
    expect(document.querySelector('.trend')).toBeNull();
    const before = tag({
      tag_id: 'a',
      readings: readings({ temperature: 20.5 }, 1),
    });
    const { at } = store.get().twin.latest.snapshot ?? { at: 0 };
    const hourBefore = (): void => {
      flush(() => {
        hourAgo.set({
          of: at,
          tags: new Map([['a', { tag: before, health: { verdict: 'healthy', reasons: [] } }]]),
        });
      });
    };
    hourBefore();
    expect(trends()).toEqual([
      '\u2197 +1.5\u00a0°C/h Temperature compared with an hour ago: +1.5\u00a0°C',
      'no reading an hour ago',
    ]);
    // With shortened days, an hour is not a clock hour.
    goLive(status({ day_length_s: 1_440 }));
    hourBefore();
    expect(trends()[0]).toContain('compared with a greenhouse hour (1\u00a0min) ago: ');
    goLive(status());
    // An outdated answer does not count.
    flush(() => {
      hourAgo.set({ of: at - 601, tags: new Map() });
    });
    expect(trends()[0]).toBe('an hour ago: unknown');
    hourAgo.set(null);
  });

  test('hidden columns are not rendered', () => {
    showTags(tags, judgement({ a: [reason()] }));
    prefer({ hidden: ['health', 'trend', 'co2', 'species', 'pest'] });
    render(<TagTable />);
    const columns = [...document.querySelectorAll<HTMLElement>('thead th')];
    const ids = columns.map((each) => each.dataset['column']);
    expect(ids).not.toContain('co2');
    expect(ids).not.toContain('health');
    expect(ids).toContain('tag');
    expect(row('a').children).toHaveLength(ids.length);
    expect(document.querySelectorAll('col')).toHaveLength(ids.length);
    expect(trends()).toEqual([]);
  });

  test('a verdict has its first reason beside it, and how many more there are', () => {
    showTags(tags, judgement({ a: [reason()], b: 'healthy' }));
    render(<TagTable />);
    expect(row('a').querySelector('.why')?.textContent).toBe('Temperature below 10.0');
    expect(row('a').querySelector('.why-count')).toBeNull();
    expect(row('b').querySelector('.why')).toBeNull();
    flush(() => {
      showTags(tags, judgement({ a: [reason(), reason({ sensor: 'humidity', value: 20 })] }));
      prefer({ hidden: ['temperature'] });
    });
    // Without its column, the value stays.
    expect(row('a').querySelector('.why')?.textContent).toMatch(/^Temperature 6.6/);
    expect(row('a').querySelector<HTMLElement>('.why-count')?.dataset['count']).toBe('1');
    expect(row('a').querySelector('.why-more')?.textContent).toMatch(/^; Humidity/);
  });

  test('strings from the wire are text and nothing else', () => {
    showTags([wireTag({ tag_id: '<img src=x onerror=alert(1)>', species: '\u202eevil' })]);
    render(<TagTable />);
    expect(document.querySelector('img')).toBeNull();
    expect(document.body.textContent).toContain('<img src=x');
    expect(document.body.textContent).not.toContain('\u202e');
  });
});

test('of a silent twin, all is as last judged, but without an age nothing is healthy', () => {
  showTags(
    [wireTag({ tag_id: '1' }), wireTag({ tag_id: '5' })],
    judgement({ 1: 'healthy', 5: [reason()] }),
  );
  render(<TagTable />);
  const verdicts = () =>
    [...document.querySelectorAll<HTMLElement>('tr[data-tag-id]')]
      .map(({ dataset }) => `${dataset['tagId']} ${dataset['health']}`)
      .sort();
  flush(goLost);
  expect(verdicts()).toEqual(['1 healthy', '5 critical']);
  flush(() => {
    receive({ isTimeLost: true });
  });
  expect(verdicts()).toEqual(['1 unknown', '5 critical']);
});
