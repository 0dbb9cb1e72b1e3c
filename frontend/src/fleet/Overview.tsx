/** All greenhouses, the worst first. */
import { memo, useDeferredValue, useEffect, useMemo, useRef, useState, type JSX } from 'react';

import { timeOfDay } from '../clock';
import { LOCALE, S } from '../strings';
import { HealthMark } from '../ui/HealthMark';
import type { FleetWords } from '../words/fleet';
import type { Seen } from './follow';
import { chosen, countsOf, FILTERS, type Filter, type Site, type Time } from './sites';

const clockTime = new Intl.DateTimeFormat(LOCALE, { timeStyle: 'medium' });
const dateAndTime = new Intl.DateTimeFormat(LOCALE, { dateStyle: 'medium', timeStyle: 'short' });
const DAY_MS = 86_400_000;

/** Of today the time of day is enough. */
function timeText(at: number): string {
  return (Math.abs(timeOfDay() - at) < DAY_MS / 2 ? clockTime : dateAndTime).format(at);
}

const ms = ({ sec, nanosec }: Time): number => sec * 1000 + nanosec / 1e6;

interface Props {
  readonly seen: Seen;
  readonly words: FleetWords;
  readonly isKiosk: boolean;
}

export function Overview({ seen, words, isKiosk }: Props): JSX.Element {
  const [filter, setFilter] = useState<Filter>('all');
  const [search, setSearch] = useState('');
  const field = useRef<HTMLInputElement>(null);
  const sites = useDeferredValue(seen.sites);
  const counts = useMemo(() => countsOf(sites.values()), [sites]);
  const shown = useMemo(() => chosen(sites, filter, search), [sites, filter, search]);

  useEffect(() => {
    const onKey = (event: KeyboardEvent): void => {
      if (event.key !== '/' || event.target instanceof HTMLInputElement) return;
      event.preventDefault();
      field.current?.focus();
    };
    document.addEventListener('keydown', onKey);
    return () => {
      document.removeEventListener('keydown', onKey);
    };
  }, []);

  return (
    <div className="fleet" data-kiosk={isKiosk}>
      <header className="fleet-head">
        <h1>{words.title}</h1>
        {!isKiosk && (
          <>
            <input
              ref={field}
              type="search"
              className="fleet-search"
              aria-label={words.search}
              aria-keyshortcuts="/"
              placeholder={words.search}
              value={search}
              onChange={(event) => {
                setSearch(event.target.value);
              }}
            />
            <div className="fleet-filters" role="group" aria-label={words.filter}>
              {FILTERS.map((each) => (
                <button
                  key={each}
                  type="button"
                  aria-pressed={filter === each}
                  onClick={() => {
                    setFilter(each);
                  }}
                >
                  {filterText(each, words)} <span className="fleet-count">{counts[each]}</span>
                </button>
              ))}
            </div>
          </>
        )}
      </header>
      <Trouble seen={seen} words={words} />
      <main aria-label={words.list}>
        <p className="unseen" role="status">
          {search || filter !== 'all' ? words.shown(shown.length, sites.size) : ''}
        </p>
        {shown.length === 0 ? (
          <p className="fleet-empty">{nothingText(seen, words)}</p>
        ) : (
          <ul className="fleet-sites">
            {shown.map((site) => (
              <SiteCard key={site.site} site={site} words={words} />
            ))}
          </ul>
        )}
      </main>
    </div>
  );
}

function filterText(filter: Filter, words: FleetWords): string {
  return filter === 'all' || filter === 'silent' ? words[filter] : S.health[filter];
}

function nothingText({ archive, sites }: Seen, words: FleetWords): string {
  if (archive === null) return words.connecting;
  if (sites.size > 0) return words.noMatch;
  return archive.is_reachable ? words.empty : '';
}

/** What keeps anything here from being as it is now. */
function Trouble({ seen, words }: { seen: Seen; words: FleetWords }): JSX.Element {
  const { archive, lostAt } = seen;
  let text = '';
  let detail = '';
  if (lostAt !== null) {
    text = words.disconnected(timeText(lostAt));
  } else if (archive && !archive.is_reachable) {
    text = words.archiveDown(archive.since ? timeText(ms(archive.since)) : '–');
    detail = archive.message;
  }
  return (
    <div role="alert" className="fleet-trouble" hidden={!text}>
      {text && <strong>{text}</strong>}
      {detail && <span lang="en">{detail}</span>}
    </div>
  );
}

const SiteCard = memo(function SiteCard({
  site,
  words,
}: {
  site: Site;
  words: FleetWords;
}): JSX.Element {
  const { name, verdict, last_verdict: last, is_live: isLive } = site;
  return (
    <li className="fleet-site" data-health={verdict} data-live={isLive}>
      <a href={`sites/${encodeURIComponent(site.site)}/${window.location.search}`}>
        <h2>{name}</h2>
        {isLive ? (
          <HealthMark verdict={verdict} />
        ) : (
          <span className="fleet-silent">{silentText(site, words)}</span>
        )}
        {isLive && last === null && <span className="fleet-line">{words.judging}</span>}
        {!isLive && last !== null && (
          <span className="fleet-line">
            {words.lastKnown(S.health[last], alarmsText(site, words))}
          </span>
        )}
        {isLive && (
          <span className="fleet-alarms" data-any={(site.active_alarms ?? 0) > 0}>
            {alarmsText(site, words)}
          </span>
        )}
        <span className="fleet-line">
          {site.last_received
            ? words.received(timeText(ms(site.last_received)))
            : words.nothingReceived}
        </span>
      </a>
    </li>
  );
});

function silentText({ lag_s: lag }: Site, words: FleetWords): string {
  return lag === null
    ? words.neverForwarded
    : words.silentSince(timeText(Math.round((timeOfDay() - lag * 1000) / 1000) * 1000));
}

function alarmsText({ active_alarms: count }: Site, words: FleetWords): string {
  if (count === null) return words.alarmsBeingRead;
  return count === 0 ? words.noAlarms : words.alarms(count);
}
