/** The bridge tests' table of states, worded in two of the page's languages. */
import { readFileSync } from 'node:fs';
import { join } from 'node:path';

import { render } from '@testing-library/react';
import { afterAll, beforeAll, beforeEach, describe, expect, test, vi } from 'vitest';

import type { Alarm, HealthReason, Verdict } from '../contract/types';
import { byCause } from '../domain/health';

type ReportedReason = readonly [
  HealthReason['kind'],
  Verdict,
  string,
  number | null,
  number | null,
];
interface Tag {
  readonly readings: Readonly<Record<string, readonly [number | null, number]>>;
  readonly verdict: Verdict;
  readonly reasons: readonly ReportedReason[];
  readonly species?: string;
}
interface House {
  readonly verdict: Verdict;
  readonly reasons: readonly HealthReason['kind'][];
  readonly day: readonly [boolean, 'light' | 'clock' | 'assumed'];
  readonly overdue: number;
}
interface State {
  readonly name: string;
  readonly tags: Readonly<Record<string, Tag | string>>;
  readonly house: House;
  readonly alarms: readonly (readonly [string, HealthReason['kind'], string, Verdict])[];
}

const FILE = join(import.meta.dirname, '../../../tests/bridge/judge/states.json');
const { alike, states } = JSON.parse(readFileSync(FILE, 'utf8')) as {
  readonly alike: Readonly<Record<string, Tag>>;
  readonly states: readonly State[];
};

/** Words that must appear, whatever else does. */
interface Language {
  readonly verdicts: Readonly<Record<Verdict, string>>;
  readonly sensors: Readonly<Record<string, string>>;
  readonly sides: readonly [below: string, above: string];
  readonly says: Readonly<Record<HealthReason['kind'], RegExp>>;
  /** An alarm's words, with its value now. */
  readonly alarms: Readonly<Record<'range' | 'pest', RegExp>>;
  /** Damp air by several sensors is one reason. */
  readonly air: RegExp;
  readonly tag: string;
  readonly house: string;
  readonly most: RegExp;
}
const LANGUAGES: Readonly<Record<'en' | 'de', Language>> = {
  en: {
    verdicts: {
      critical: 'Critical',
      stressed: 'Stressed',
      unknown: 'Unknown',
      healthy: 'Healthy',
    },
    sensors: {
      temperature: 'Temperature',
      humidity: 'Humidity',
      co2: 'CO₂',
      light: 'Light',
      soil_moisture: 'Soil moisture',
      vpd: 'VPD',
    },
    sides: ['below', 'above'],
    says: {
      range: /^\D+(\d.*kPa, )?(below|above) \d/,
      reading_failed: /the sensor returns no value$/,
      scan_failed: /^Last scan failed: (not reachable|not readable)/,
      pest: /^\d+ pests? seen$/,
      old: /[Nn]ot scanned|[Nn]o scan|no reading/,
      changed: /changed/,
      silent: /No current data from the twin/,
      stopped: /^No tag is being scanned/,
    },
    alarms: { range: /(below|above) \d/, pest: /^Pest seen, now \d+ pests? \(critical\)$/ },
    air: /^Air too (dry|damp)/,
    tag: 'Tag 1',
    house: 'Whole greenhouse',
    most: /More than half/,
  },
  de: {
    verdicts: {
      critical: 'Kritisch',
      stressed: 'Gestresst',
      unknown: 'Unbekannt',
      healthy: 'Gesund',
    },
    sensors: {
      temperature: 'Temperatur',
      humidity: 'Luftfeuchte',
      co2: 'CO₂',
      light: 'Licht',
      soil_moisture: 'Bodenfeuchte',
      vpd: 'VPD',
    },
    sides: ['unter', 'über'],
    says: {
      range: /^\D+(\d.*kPa, )?(unter|über) \d/,
      reading_failed: /Sensor liefert keinen Wert$/,
      scan_failed: /^Fehlversuch: (nicht erreichbar|nicht erkannt|nicht lesbar)/,
      pest: /^\d+ Schädlinge? gefunden$/,
      old: /gemessen|kein Messwert|[Kk]eine Messung/,
      changed: /verändert/,
      silent: /Keine aktuellen Daten vom digitalen Zwilling/,
      stopped: /nichts mehr gemessen/,
    },
    alarms: {
      range: /(unter|über) \d/,
      pest: /^Schädlinge gefunden, jetzt \d+ Schädlinge? \(kritisch\)$/,
    },
    air: /^Luft zu (trocken|feucht)/,
    tag: 'Messpunkt 1',
    house: 'Ganzes Gewächshaus',
    most: /mehr als der Hälfte/,
  },
};

const tagsOf = (state: State): [string, Tag][] =>
  Object.entries(state.tags).map(([id, tag]) => {
    const own = typeof tag === 'string' ? alike[tag] : tag;
    if (!own) throw new Error(`tag ${id} of “${state.name}” is like none`);
    return [id, own];
  });

const SINCE = 0;
const reasonOf = ([kind, verdict, sensor, value, limit]: ReportedReason): HealthReason => ({
  ...{ kind, verdict, sensor, value, limit },
  since: SINCE,
});

describe.each(['en', 'de'] as const)('%s', (language) => {
  const words = LANGUAGES[language];

  /** The page's modules, loaded again because they bind their language on import. */
  const load = async () => ({
    ...(await import('../testing/page')),
    ...(await import('../testing/tags')),
    ...(await import('./HealthSummary')),
    ...(await import('./TagTable')),
    ...(await import('../alarms/watch')),
    ...(await import('../alarms/latest')),
    ...(await import('../store/app')),
  });
  let page: Awaited<ReturnType<typeof load>>;

  beforeAll(async () => {
    history.replaceState(null, '', `/?lang=${language}`);
    vi.resetModules();
    page = await load();
  });
  afterAll(() => {
    history.replaceState(null, '', '/');
  });
  beforeEach(() => {
    vi.stubGlobal('fetch', () => Promise.reject(new Error('no server')));
  });

  /** Asserts that a text names a reason's kind, sensor and side. */
  const expectSaid = (
    text: string,
    [kind, , sensor, value, limit]: ReportedReason,
    says = words.says,
  ): void => {
    expect(text).toMatch(says[kind]);
    if (sensor !== '') expect(text).toContain(words.sensors[sensor]);
    if (kind === 'range' && value !== null && limit !== null) {
      expect(text).toContain(words.sides[value < limit ? 0 : 1]);
    }
  };

  test.each(states)('$name', (state) => {
    const { house } = state;
    const tags = tagsOf(state);
    const { wireTag, readings, showTags, HealthSummary, TagTable } = page;
    showTags(
      tags.map(([tag_id, tag]) => {
        const values = Object.entries(tag.readings).map(([name, [value]]) => [name, value]);
        return wireTag({
          tag_id,
          species: tag.species ?? '',
          readings: readings(Object.fromEntries(values) as Record<string, number | null>),
        });
      }),
      {
        house: {
          verdict: house.verdict,
          reasons: house.reasons.map((kind) => reasonOf([kind, house.verdict, '', null, null])),
          day: { is_day: house.day[0], source: house.day[1] },
          patrol: { interval_s: 120, last_scan: SINCE, overdue: house.overdue },
        },
        tags: Object.fromEntries(
          tags.map(([id, { verdict, reasons }]) => [
            id,
            { verdict, reasons: reasons.map(reasonOf) },
          ]),
        ),
      },
    );
    const { container } = render(
      <>
        <HealthSummary kiosk={false} />
        <TagTable />
      </>,
    );

    const summary = container.querySelector<HTMLElement>('[data-testid=greenhouse-health]');
    expect(summary?.dataset['health']).toBe(house.verdict);
    expect(summary?.textContent).toContain(words.verdicts[house.verdict]);
    // "Most unknown" only if most are unknown.
    const unknown = tags.filter(([, { verdict }]) => verdict === 'unknown').length;
    const isMost = 2 * unknown > tags.length;
    if (house.verdict === 'unknown' && house.reasons.length === 0 && unknown > 0) {
      expect(words.most.test(summary?.textContent ?? '')).toBe(isMost);
    }
    for (const kind of house.reasons) expect(container.textContent).toMatch(words.says[kind]);
    for (const [id, { verdict, reasons }] of tags) {
      const row = container.querySelector<HTMLElement>(`tr[data-tag-id="${id}"]`);
      expect(row?.dataset['health']).toBe(verdict);
      // The verdict's mark (shape and colour) and word.
      const mark = row?.querySelector('.health-mark');
      expect(mark?.getAttribute('data-health')).toBe(verdict);
      expect(mark?.textContent).toContain(words.verdicts[verdict]);
      const why = row?.querySelector('.why')?.textContent ?? '';
      // Without a reason, it may say that nothing has an ideal range.
      const isUnranged = /(with an ideal range|mit Idealbereich)$/.test(why);
      const causes = byCause(reasons.map(reasonOf));
      const texts = why === '' || isUnranged ? [] : why.split('; ');
      expect(texts).toHaveLength(causes.length);
      for (const [kind, verdict, sensor, value, limit] of reasons) {
        const at = causes.findIndex((own) =>
          own.some((it) => it.kind === kind && it.sensor === sensor),
        );
        if (causes[at]?.length === 1)
          expectSaid(texts[at] ?? '', [kind, verdict, sensor, value, limit]);
        else expect(texts[at]).toMatch(words.air);
      }
    }

    for (const [tag_id, kind, sensor, verdict] of state.alarms) {
      const of = tags.find(([id]) => id === tag_id)?.[1].reasons ?? [];
      const reported: ReportedReason = of.find((it) => it[0] === kind && it[2] === sensor) ?? [
        kind,
        verdict,
        sensor,
        null,
        null,
      ];
      const alarm: Alarm = {
        ...{ id: `${tag_id} ${kind}`, tag_id, raised_at: SINCE, cleared_at: null, worst: null },
        reason: reasonOf(reported),
      };
      const item = { alarm, isAcknowledged: false, shelf: null };
      const text = page.severalNow(page.store.get(), [item], ([only = '']) => only);
      expect(text.startsWith(tag_id === '' ? words.house : words.tag.replace('1', tag_id))).toBe(
        true,
      );
      expectSaid(text.slice(text.indexOf(': ') + 2), reported, { ...words.says, ...words.alarms });
    }
    const calls = state.alarms.length;
    expect(page.titleOf(String(calls), null)).toBe(
      calls === 0 ? 'Lupin twin' : `(${calls}) Lupin twin`,
    );
  });
});
