/** All greenhouses, the worst first; their alarms; and one sensor of several compared. */
import {
  type JSX,
  lazy,
  memo,
  Suspense,
  useCallback,
  useDeferredValue,
  useEffect,
  useMemo,
  useRef,
  useState,
} from 'react';

import { timeOfDay } from '../clock';
import { S } from '../strings';
import { HealthMark } from '../ui/HealthMark';
import type { CauseText } from './Causes';
import { Choice } from './Choice';
import type { Seen } from './follow';
import {
  alarmCount,
  chosen,
  countsOf,
  type Filter,
  FILTERS,
  type Group,
  grouped,
  groupNames,
  type Site,
  siteLink,
  timeText,
  words,
} from './sites';

const Alarms = lazy(async () => ({ default: (await import('./views')).Alarms }));
const Causes = lazy(async () => ({ default: (await import('./views')).Causes }));
const Report = lazy(async () => ({ default: (await import('./views')).Report }));
// Loaded when first shown: it brings the charts.
const Compare = lazy(() => import('./Compare'));

const VIEWS = ['sites', 'alarms', 'compare', 'report'] as const;
type View = (typeof VIEWS)[number];

/** The group on a wall screen; empty: all. */
const group = new URLSearchParams(window.location.search).get('group') ?? '';

interface Props {
  readonly seen: Seen;
  readonly isKiosk: boolean;
}

export function Overview({ seen, isKiosk }: Props): JSX.Element {
  const [view, setView] = useState<View>('sites');
  const [filter, setFilter] = useState<Filter>('all');
  const [search, setSearch] = useState('');
  const [causeText, setCauseText] = useState<CauseText | null>(null);
  const onWords = useCallback((text: CauseText) => setCauseText(() => text), []);
  const field = useRef<HTMLInputElement>(null);
  const sites = useDeferredValue(seen.sites);
  const counts = useMemo(() => countsOf(sites.values()), [sites]);
  const alarms = useMemo(() => alarmCount(sites.values()), [sites]);
  // Until then there is nothing to count.
  const hasArchive = seen.archive !== null;
  // Otherwise a count of 0 does not mean that there is no alarm.
  const isKnown =
    hasArchive &&
    asOfWhen(seen) === null &&
    [...sites.values()].every((site) => site.is_live && site.active_alarms !== null);
  const groups = useMemo(() => groupNames(sites.values()), [sites]);
  const shown = useMemo(() => chosen(sites, filter, search, group), [sites, filter, search]);

  useEffect(() => {
    document.title = alarms === 0 ? words.sites : `(${alarms}) ${words.sites}`;
  }, [alarms]);

  useEffect(() => {
    const onKey = (event: KeyboardEvent): void => {
      if (event.key !== '/' || event.target instanceof HTMLInputElement) return;
      event.preventDefault();
      field.current?.focus();
    };
    document.addEventListener('keydown', onKey);
    return () => document.removeEventListener('keydown', onKey);
  }, []);

  return (
    <div className="fleet" data-kiosk={isKiosk} data-size={sizeOf(sites.size)}>
      <header className="fleet-head">
        <h1>{words.sites}</h1>
        {isKiosk && (
          <span className="fleet-alarms" data-any={alarms > 0}>
            {alarms > 0 ? S.alarmCount(alarms) : isKnown && words.noAlarms}
          </span>
        )}
        {!isKiosk && (
          <>
            <Choice
              options={VIEWS}
              value={view}
              onChange={setView}
              text={(each) => (each === 'alarms' || each === 'report' ? S[each] : words[each])}
              count={(each) => (each === 'alarms' && hasArchive ? alarms : null)}
            />
            <input
              ref={field}
              type="search"
              className="fleet-search"
              aria-label={words.search}
              aria-keyshortcuts="/"
              placeholder={words.search}
              value={search}
              onChange={(event) => setSearch(event.target.value)}
            />
            <Choice
              label={words.filter}
              options={FILTERS}
              value={filter}
              onChange={setFilter}
              text={filterText}
              count={(each) => (hasArchive ? counts[each] : null)}
            />
          </>
        )}
      </header>
      <Trouble seen={seen} />
      <Suspense>
        <Causes onWords={onWords} />
      </Suspense>
      <main aria-label={view === 'alarms' ? words.alarmList : words.list}>
        <p className="unseen" role="status">
          {search || group || filter !== 'all' ? words.shown(shown.length, sites.size) : ''}
        </p>
        {shown.length === 0 ? (
          <p className="fleet-empty">{nothingText(seen)}</p>
        ) : view === 'sites' ? (
          <Cards shown={shown} groups={groups} asOf={asOfWhen(seen)} causeText={causeText} />
        ) : (
          <Suspense fallback={<p className="fleet-empty">{S.emptyConnecting}</p>}>
            {view === 'alarms' && <Alarms shown={shown} />}
            {view === 'compare' && <Compare shown={shown} />}
            {view === 'report' && <Report shown={shown} />}
          </Suspense>
        )}
      </main>
    </div>
  );
}

/** The fewer greenhouses, the more each card shows. */
const sizeOf = (count: number): string => (count <= 6 ? 'few' : count <= 24 ? 'some' : 'many');

/** When all of it was last known, seconds since the epoch; null: it is as of now. */
function asOfWhen({ archive, lostAt }: Seen): number | null {
  if (lostAt !== null || !archive || archive.is_reachable) return lostAt;
  return archive.since;
}

function nothingText({ archive, sites }: Seen): string {
  if (archive === null) return S.emptyConnecting;
  if (sites.size > 0) return words.noMatch;
  return archive.is_reachable ? words.empty : '';
}

function Trouble({ seen }: { seen: Seen }): JSX.Element {
  const { archive, lostAt } = seen;
  let text = '';
  let detail = '';
  if (lostAt !== null) {
    text = words.disconnected(timeText(lostAt));
  } else if (archive && !archive.is_reachable) {
    text = words.archiveDown(archive.since === null ? '–' : timeText(archive.since));
    detail = archive.message;
  }
  return (
    <div role="alert" className="fleet-trouble" hidden={!text}>
      {text && <strong>{text}</strong>}
      {detail && (
        <details>
          <summary>{S.more}</summary>
          <span lang="en">{detail}</span>
        </details>
      )}
    </div>
  );
}

/** After this long without data, a greenhouse counts as silent, or the archive as down. */
const LIVE_S = 20;

interface Listed {
  /** When all of it was last known, seconds since the epoch; null: it is as of now. */
  readonly asOf: number | null;
  /** null: not loaded yet. */
  readonly causeText: CauseText | null;
}

function Cards({
  shown,
  groups,
  ...listed
}: Listed & { shown: readonly Site[]; groups: readonly string[] }): JSX.Element {
  const parts = useMemo(() => grouped(shown, groups), [shown, groups]);
  if (groups.length === 0) return <List sites={shown} {...listed} />;
  return (
    <>
      {parts.map((part) => (
        <GroupOf key={part.name} group={part} {...listed} />
      ))}
    </>
  );
}

function GroupOf({ group, ...listed }: Listed & { group: Group }): JSX.Element {
  const { name, sites } = group;
  return (
    <details className="fleet-group" open>
      <summary>
        <h2>{name || words.others}</h2>
        <HealthMark verdict={sites[0].verdict} word={false} />
        <span className="fleet-line">{groupText(sites)}</span>
      </summary>
      <List sites={sites} {...listed} />
    </details>
  );
}

function groupText(sites: readonly Site[]): string {
  const counts = countsOf(sites);
  const alarms = alarmCount(sites);
  const texts = FILTERS.filter((each) => each !== 'all' && each !== 'healthy' && counts[each] > 0);
  return [
    String(sites.length),
    ...texts.map((each) => `${counts[each]} ${filterText(each, counts[each])}`),
    ...(alarms > 0 ? [S.alarmCount(alarms)] : []),
  ].join(' · ');
}

function filterText(filter: Filter, count = 1): string {
  if (filter === 'all' || filter === 'silent') return words[filter];
  return (count === 1 ? S.health : S.healthMany)[filter];
}

function List({ sites, ...listed }: Listed & { sites: readonly Site[] }): JSX.Element {
  return (
    <ul className="fleet-sites">
      {sites.map((site) => (
        <SiteCard key={site.site} site={site} {...listed} />
      ))}
    </ul>
  );
}

const SiteCard = memo(function SiteCard({
  site,
  asOf,
  causeText,
}: Listed & { site: Site }): JSX.Element {
  const { name, verdict, last_verdict: last, map } = site;
  const isLive = site.is_live && asOf === null;
  const origin = originText(site);
  return (
    <li className="fleet-site" data-health={verdict} data-live={isLive}>
      <a href={siteLink(site)}>
        <h3>
          <span className="fleet-name">{name}</span>
          {origin && <span className="fleet-origin">{origin}</span>}
        </h3>
        <div className="fleet-facts">
          {map && (
            <img
              className="fleet-map"
              src={`api/sites/${encodeURIComponent(site.site)}/map.svg?v=${map}`}
              alt=""
              width={88}
              height={48}
              loading="lazy"
              decoding="async"
            />
          )}
          {isLive ? (
            <HealthMark verdict={verdict} />
          ) : (
            <span className="fleet-silent">{silentText(site, asOf)}</span>
          )}
          {isLive && last === null && <span className="fleet-line">{words.judging}</span>}
          {isLive && isAhead(site) && (
            <span className="fleet-line">
              {S.clockTodo.clock_doubted} {S.offlineWhy.clock_ahead}
            </span>
          )}
          {!isLive && last !== null && last !== 'unknown' && (
            <span className="fleet-line">{words.lastKnown(S.health[last])}</span>
          )}
          <span className="fleet-alarms" data-any={(site.active_alarms ?? 0) > 0}>
            {(isLive || site.active_alarms !== 0) && countText(site.active_alarms)}
          </span>
          {causeText !== null &&
            site.causes.map((cause, index) => {
              const [text, todo] = causeText(cause);
              return (
                <span key={index} className="fleet-cause">
                  <HealthMark verdict={cause.reason.verdict} text={text} />
                  <strong>{todo}</strong>
                </span>
              );
            })}
        </div>
        <span className="fleet-line">
          {site.last_received === null
            ? words.nothingReceived
            : words.received(timeText(site.last_received))}
        </span>
      </a>
    </li>
  );
});

/** Says that data are simulated or recorded; null: not known, or from a robot. */
function originText({ origin }: Site): string | null {
  return origin in S.origin ? S.origin[origin as keyof typeof S.origin] : null;
}

function silentText(site: Site, asOf: number | null): string {
  const at = site.heardAt;
  if (at === null) return words.silent;
  const wasLive = site.is_live || (asOf !== null && at > asOf - LIVE_S);
  return wasLive && asOf !== null ? words.asOf(timeText(asOf)) : words.silentSince(timeText(at));
}

/** As in the fleet's judge, seconds. */
const MOST_AHEAD_S = 600;

/** Its clock is ahead: that is why its status is unknown. */
const isAhead = ({ verdict, last_received: at }: Site): boolean =>
  verdict === 'unknown' && at !== null && at > timeOfDay() / 1000 + MOST_AHEAD_S;

function countText(count: number | null): string {
  if (count === null) return words.alarmsBeingRead;
  return count === 0 ? words.noAlarms : S.alarmCount(count);
}
