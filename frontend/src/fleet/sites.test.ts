import { expect, test } from 'vitest';

import {
  alarmCount,
  chosen,
  countsOf,
  grouped,
  groupNames,
  parseSites,
  withFrame,
  type Site,
  type SitesFrame,
} from './sites';

type Entry = SitesFrame['sites'][number];

const site = (name: string, more: Partial<Entry> = {}): Entry => ({
  site: name,
  name,
  verdict: 'healthy',
  last_verdict: 'healthy',
  active_alarms: 0,
  last_received: 1_700_000_000,
  lag_s: 0.5,
  is_live: true,
  origin: 'robot',
  map: null,
  causes: [],
  ...more,
});
const frame = (sites: readonly Entry[], more: Partial<SitesFrame> = {}): SitesFrame => ({
  type: 'sites',
  is_whole: true,
  archive: { is_reachable: true, message: '', since: null },
  sites,
  gone: [],
  ...more,
});
const of = (...sites: Entry[]): ReadonlyMap<string, Site> => withFrame(new Map(), frame(sites));

test('the worst come first, then the most alarms, then as people count', () => {
  const sites = of(
    site('gh10'),
    site('gh2'),
    site('dark', { verdict: 'unknown', is_live: false }),
    site('b', { verdict: 'stressed', active_alarms: 1 }),
    site('a', { verdict: 'stressed', active_alarms: 3 }),
    site('worst', { verdict: 'critical' }),
  );
  const shown = chosen(sites, 'all', '').map(({ name }) => name);
  expect(shown).toEqual(['worst', 'a', 'b', 'dark', 'gh2', 'gh10']);
});

test('sites that share the part of their names before the first hyphen are a group', () => {
  const sites = of(
    site('north-1'),
    site('north-2', { verdict: 'critical', active_alarms: 3 }),
    site('south-1-a', { verdict: 'stressed', active_alarms: null }),
    site('south-2'),
    site('rose-house'),
    site('gh1'),
  );
  const known = groupNames(sites.values());
  expect(known).toEqual(['north', 'south']);
  const groups = grouped(chosen(sites, 'all', ''), known);
  // The worst site decides, and sites without a group are together.
  expect(groups.map((group) => [group.name, group.sites.map(({ site: id }) => id)])).toEqual([
    ['north', ['north-2', 'north-1']],
    ['south', ['south-1-a', 'south-2']],
    ['', ['gh1', 'rose-house']],
  ]);
  expect(chosen(sites, 'all', '', 'north').map(({ site: id }) => id)).toEqual([
    'north-2',
    'north-1',
  ]);
  expect(alarmCount(sites.values())).toBe(3);
});

test('one group alone is none', () => {
  expect(groupNames(of(site('gh-1'), site('gh-2')).values())).toEqual([]);
  expect(groupNames(of(site('gh-1'), site('gh-2'), site('x')).values())).toEqual(['gh']);
});

test('search and filter go together', () => {
  const sites = of(
    site('north-1', { name: 'Noord 1' }),
    site('north-2', { verdict: 'critical' }),
    site('south', { verdict: 'unknown', is_live: false }),
    site('empty', { verdict: 'unknown' }),
  );
  expect(chosen(sites, 'critical', '')).toHaveLength(1);
  expect(chosen(sites, 'all', ' NOORD ').map(({ site: id }) => id)).toEqual(['north-1']);
  expect(chosen(sites, 'silent', 'north')).toEqual([]);
  expect(countsOf(sites.values())).toEqual({
    ...{ all: 4, critical: 1, stressed: 0, unknown: 1, silent: 1, healthy: 1 },
  });
});

test('a frame changes what it names, and one that is whole takes the place of all', () => {
  const first = of(site('a'), site('b'));
  const second = withFrame(
    first,
    frame([site('b', { verdict: 'critical' })], { is_whole: false, gone: ['a'] }),
  );
  expect([...second.values()].map(({ site: id, verdict }) => [id, verdict])).toEqual([
    ['b', 'critical'],
  ]);
  expect([...withFrame(second, frame([site('c')])).keys()]).toEqual(['c']);
});

test.each([[null], [new ArrayBuffer(1)], ['{']])('%j is no frame', (data) => {
  expect(() => parseSites(data)).toThrow();
});

test('a frame of the server is one, another is passed over', () => {
  expect(parseSites('{"type":"state"}')).toBeNull();
  expect(parseSites(JSON.stringify(frame([site('a')])))?.sites).toHaveLength(1);
});
