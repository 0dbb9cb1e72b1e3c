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

interface Props {
  readonly shown: readonly Site[];
  readonly groups: readonly string[];
  readonly words: FleetWords;
}

export function Cards({ shown, groups, words }: Props): JSX.Element {
  const parts = useMemo(() => grouped(shown, groups), [shown, groups]);
  if (groups.length === 0) return <List sites={shown} words={words} />;
  return (
    <>
      {parts.map((part) => (
        <GroupOf key={part.name} group={part} words={words} />
      ))}
    </>
  );
}

function GroupOf({ group, words }: { group: Group; words: FleetWords }): JSX.Element {
  const { name, sites } = group;
  const worst = sites[0];
  return (
    <details className="fleet-group" open>
      <summary>
        <h2>{name || words.others}</h2>
        {worst && <HealthMark verdict={worst.verdict} word={false} />}
        <span className="fleet-line">{groupText(sites, words)}</span>
      </summary>
      <List sites={sites} words={words} />
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
    ...(alarms > 0 ? [words.alarms(alarms)] : []),
  ].join(' · ');
}

export function filterText(filter: Filter, words: FleetWords): string {
  return filter === 'all' || filter === 'silent' ? words[filter] : S.health[filter];
}

function List({ sites, words }: { sites: readonly Site[]; words: FleetWords }): JSX.Element {
  return (
    <ul className="fleet-sites">
      {sites.map((site) => (
        <SiteCard key={site.site} site={site} words={words} />
      ))}
    </ul>
  );
}

const SiteCard = memo(function SiteCard({
  site,
  words,
}: {
  site: Site;
  words: FleetWords;
}): JSX.Element {
  const { name, verdict, last_verdict: last, is_live: isLive, map } = site;
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
          <span className="fleet-silent">{silentText(site, words)}</span>
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

function silentText({ lag_s: lag }: Site, words: FleetWords): string {
  return lag === null ? words.neverForwarded : words.silentSince(timeText(silentAt(lag)));
}

function countText(count: number | null, words: FleetWords): string {
  if (count === null) return words.alarmsBeingRead;
  return count === 0 ? words.noAlarms : words.alarms(count);
}
