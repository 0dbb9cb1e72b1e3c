/** A card a greenhouse; in groups where there are some. */
import { memo, useEffect, useMemo, useRef, useState, type JSX } from 'react';

import { S } from '../strings';
import { HealthMark } from '../ui/HealthMark';
import type { FleetWords } from '../words/fleet';
import {
  alarmCount,
  countsOf,
  FILTERS,
  grouped,
  type Filter,
  type Group,
  type Site,
} from './sites';
import { ms, silentAt, timeText } from './times';

const STAYS_MS = 200;
/** So long after its last word a greenhouse counts as silent, and the archive as down. */
const LIVE_MS = 20_000;

interface Props {
  readonly shown: readonly Site[];
  readonly groups: readonly string[];
  readonly words: FleetWords;
  /** When all of it was last known, ms since the epoch; null: it is as of now. */
  readonly asOf: number | null;
}

export function Cards({ shown, groups, words, asOf }: Props): JSX.Element {
  const parts = useMemo(() => grouped(shown, groups), [shown, groups]);
  if (groups.length === 0) return <List sites={shown} words={words} asOf={asOf} />;
  return (
    <>
      {parts.map((part) => (
        <GroupOf key={part.name} group={part} words={words} asOf={asOf} />
      ))}
    </>
  );
}

interface Listed {
  readonly words: FleetWords;
  readonly asOf: number | null;
}

function GroupOf({ group, words, asOf }: Listed & { group: Group }): JSX.Element {
  const { name, sites } = group;
  const worst = sites[0];
  return (
    <details className="fleet-group" open>
      <summary>
        <h2>{name || words.others}</h2>
        {worst && <HealthMark verdict={worst.verdict} word={false} />}
        <span className="fleet-line">{groupText(sites, words)}</span>
      </summary>
      <List sites={sites} words={words} asOf={asOf} />
    </details>
  );
}

/** How many, and what is wrong with them. */
function groupText(sites: readonly Site[], words: FleetWords): string {
  const counts = countsOf(sites);
  const alarms = alarmCount(sites);
  const texts = FILTERS.filter((each) => each !== 'all' && each !== 'healthy' && counts[each] > 0);
  return [
    String(sites.length),
    ...texts.map((each) => `${counts[each]} ${filterText(each, words)}`),
    ...(alarms > 0 ? [S.alarmCount(alarms)] : []),
  ].join(' · ');
}

export function filterText(filter: Filter, words: FleetWords): string {
  return filter === 'all' || filter === 'silent' ? words[filter] : S.health[filter];
}

function List({ sites, words, asOf }: Listed & { sites: readonly Site[] }): JSX.Element {
  return (
    <ul className="fleet-sites">
      {sites.map((site) => (
        <SiteCard key={site.site} site={site} words={words} asOf={asOf} />
      ))}
    </ul>
  );
}

const SiteCard = memo(function SiteCard({
  site,
  words,
  asOf,
}: Listed & { site: Site }): JSX.Element {
  const { name, verdict, last_verdict: last, map } = site;
  const isLive = site.is_live && asOf === null;
  const origin = originText(site);
  return (
    <li className="fleet-site" data-health={verdict} data-live={isLive}>
      <a href={`sites/${encodeURIComponent(site.site)}/${window.location.search}`}>
        <h3>
          <span className="fleet-name">{name}</span>
          {origin && <span className="fleet-origin">{origin}</span>}
        </h3>
        {map && <SmallMap src={`api/sites/${encodeURIComponent(site.site)}/map.svg?v=${map}`} />}
        {isLive ? (
          <HealthMark verdict={verdict} />
        ) : (
          <span className="fleet-silent">{silentText(site, words, asOf)}</span>
        )}
        {isLive && last === null && <span className="fleet-line">{words.judging}</span>}
        {!isLive && last !== null && (
          <span className="fleet-line">{words.lastKnown(S.health[last])}</span>
        )}
        <span className="fleet-alarms" data-any={(site.active_alarms ?? 0) > 0}>
          {countText(site.active_alarms, words)}
        </span>
        <span className="fleet-line">
          {site.last_received
            ? words.received(timeText(ms(site.last_received)))
            : words.nothingReceived}
        </span>
      </a>
    </li>
  );
});

/** Fetched once its card stays in sight: whoever scrolls past waits for none of them. */
function SmallMap({ src }: { src: string }): JSX.Element {
  const place = useRef<HTMLSpanElement>(null);
  const [isShown, setShown] = useState(false);
  useEffect(() => {
    let timer: ReturnType<typeof setTimeout> | undefined;
    const seen = new IntersectionObserver(([entry]) => {
      clearTimeout(timer);
      if (!entry?.isIntersecting) return;
      timer = setTimeout(() => {
        setShown(true);
        seen.disconnect();
      }, STAYS_MS);
    });
    if (place.current) seen.observe(place.current);
    return () => {
      clearTimeout(timer);
      seen.disconnect();
    };
  }, []);
  return (
    <span ref={place} className="fleet-map">
      {isShown && <img src={src} alt="" width={88} height={48} decoding="async" />}
    </span>
  );
}

/** What no robot observed, or not now; null: that is not known, or need not be said. */
export function originText({ origin }: Site): string | null {
  return origin in S.origin ? S.origin[origin as keyof typeof S.origin] : null;
}

function silentText(site: Site, words: FleetWords, asOf: number | null): string {
  if (site.lag_s === null) return words.neverForwarded;
  const at = silentAt(site.lag_s);
  const wasLive = site.is_live || (asOf !== null && at > asOf - LIVE_MS);
  return wasLive && asOf !== null ? words.asOf(timeText(asOf)) : words.silentSince(timeText(at));
}

function countText(count: number | null, words: FleetWords): string {
  if (count === null) return words.alarmsBeingRead;
  return count === 0 ? words.noAlarms : S.alarmCount(count);
}
