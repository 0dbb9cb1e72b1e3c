/** The server's data on all sites, and their order, groups and filter on the page. Pure. */
import { timeOfDay } from '../clock';
import { inSeconds } from '../contract/stamps';
import type { HealthReason, Verdict } from '../contract/types';
import { groupedBy } from '../domain/memo';
import { LANGUAGE, LOCALE } from '../strings';
import { FLEET_WORDS } from '../words/fleet';

export const words = FLEET_WORDS[LANGUAGE];

/** An entry of `/api/sites`; see the server's `overview.py`. */
interface SiteEntry {
  readonly site: string;
  readonly name: string;
  readonly verdict: Verdict;
  /** The last known verdict of a silent site; null: being computed. */
  readonly last_verdict: Verdict | null;
  readonly active_alarms: number | null;
  readonly last_received: number | null;
  readonly lag_s: number | null;
  readonly is_live: boolean;
  readonly origin: string;
  /** Changes with its small map; null: it has none. */
  readonly map: string | null;
  /** Of its active alarms that are not shelved, the worst first; its silence is none. */
  readonly causes: readonly Cause[];
}

export type Site = Omit<SiteEntry, 'lag_s'> & {
  /** When its forwarder last confirmed, seconds since the epoch; null: never. */
  readonly heardAt: number | null;
};

/** One cause of alarms: its worst alarm's reason and tag, and at how many tags. */
export interface Cause {
  readonly reason: HealthReason;
  readonly tag_id: string;
  readonly count: number;
  /** Set if several sensors tell of it. */
  readonly air: 'damp' | 'dry' | null;
}

export interface Archive {
  readonly is_reachable: boolean;
  readonly message: string;
  readonly since: number | null;
}

export interface SitesFrame {
  readonly type: 'sites';
  readonly is_whole: boolean;
  readonly archive: Archive;
  readonly sites: readonly SiteEntry[];
  readonly gone: readonly string[];
}

const MOST_NAMED = 50;

/** Sites for a query, sorted so that a new worst site does not change it; empty: too many, so all. */
export const namesOf = (sites: readonly Site[]): string =>
  sites.length > MOST_NAMED ? '' : String(sites.map(({ site }) => site).sort());

/** Address of a site's page, with this page's parameters. */
export const siteLink = ({ site }: Pick<Site, 'site'>): string =>
  `sites/${encodeURIComponent(site)}/${window.location.search}`;

export type Sites = ReadonlyMap<string, Site>;

export const FILTERS = ['all', 'critical', 'stressed', 'unknown', 'silent', 'healthy'] as const;
export type Filter = (typeof FILTERS)[number];

/** The worst first. Not imported from `domain/health`, which the first view here does not need. */
const VERDICTS: readonly Verdict[] = ['critical', 'stressed', 'unknown', 'healthy'];

/** null: no frame of the overview. */
export function parseSites(data: unknown): SitesFrame | null {
  const frame = inSeconds(JSON.parse(String(data))) as SitesFrame | { readonly type: '' };
  return frame.type === 'sites' ? frame : null;
}

export function withFrame(before: Sites, frame: SitesFrame): Sites {
  const sites = new Map(frame.is_whole ? [] : before);
  for (const name of frame.gone) sites.delete(name);
  // An entry comes only when it changes: its lag is that of now only here.
  for (const { lag_s: lag, ...site } of frame.sites) {
    const heardAt = lag === null ? null : Math.round(timeOfDay() / 1000 - lag);
    sites.set(site.site, { ...site, heardAt });
  }
  return sites;
}

/** The filter button that counts it, beside "All". */
const filterOf = (site: Site): Filter => (site.is_live ? site.verdict : 'silent');

export function countsOf(sites: Iterable<Site>): Readonly<Record<Filter, number>> {
  const counts = { all: 0, critical: 0, stressed: 0, unknown: 0, silent: 0, healthy: 0 };
  for (const site of sites) {
    counts.all += 1;
    counts[filterOf(site)] += 1;
  }
  return counts;
}

const names = new Intl.Collator('en', { numeric: true, sensitivity: 'base' });

/** By status, then most alarms first, then by name, with numbers in order. */
function worstFirst(a: Site, b: Site): number {
  return (
    VERDICTS.indexOf(a.verdict) - VERDICTS.indexOf(b.verdict) ||
    (b.active_alarms ?? 0) - (a.active_alarms ?? 0) ||
    names.compare(a.name, b.name)
  );
}

export const alarmCount = (sites: Iterable<Site>): number =>
  [...sites].reduce((sum, { active_alarms: count }) => sum + (count ?? 0), 0);

/** A site's group: its name up to the first "-"; without one it has none. */
const prefixOf = ({ site }: Site): string => (site.includes('-') ? (site.split('-')[0] ?? '') : '');

/** The groups, sorted by name; a single one is not offered. */
export function groupNames(sites: Iterable<Site>): readonly string[] {
  const counts = new Map<string, number>();
  let all = 0;
  for (const site of sites) {
    all += 1;
    const prefix = prefixOf(site);
    if (prefix) counts.set(prefix, (counts.get(prefix) ?? 0) + 1);
  }
  const found = [...counts].filter(([, count]) => count > 1 && count < all);
  return found.map(([name]) => name).sort(names.compare);
}

export type Group = ReturnType<typeof grouped>[number];

/** Sites by group, in the order of each group's first site; the nameless group has the others. */
export function grouped(shown: readonly Site[], known: readonly string[]) {
  const groups = groupedBy(shown, (site) => {
    const prefix = prefixOf(site);
    return known.includes(prefix) ? prefix : '';
  });
  return [...groups].map(([name, sites]) => ({ name, sites }));
}

/** The sites to show, the worst first; of one group, unless `group` is empty. */
export function chosen(sites: Sites, filter: Filter, search: string, group = ''): readonly Site[] {
  const wanted = search.trim().toLowerCase();
  return [...sites.values()]
    .filter((site) => filter === 'all' || filterOf(site) === filter)
    .filter((site) => !group || prefixOf(site) === group)
    .filter(
      ({ site, name }) =>
        !wanted || name.toLowerCase().includes(wanted) || site.toLowerCase().includes(wanted),
    )
    .sort(worstFirst);
}

const clockTime = new Intl.DateTimeFormat(LOCALE, { timeStyle: 'medium' });
const dateAndTime = new Intl.DateTimeFormat(LOCALE, { dateStyle: 'medium', timeStyle: 'short' });
const HALF_A_DAY_S = 43_200;

/** A time, seconds since the epoch; today only the time of day is shown. */
export function timeText(at: number): string {
  const isNear = Math.abs(timeOfDay() / 1000 - at) < HALF_A_DAY_S;
  return (isNear ? clockTime : dateAndTime).format(at * 1000);
}
