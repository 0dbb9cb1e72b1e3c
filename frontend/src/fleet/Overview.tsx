/** All greenhouses, the worst first; their alarms; and one sensor of several beside each other. */
import {
  lazy,
  Suspense,
  useDeferredValue,
  useEffect,
  useMemo,
  useRef,
  useState,
  type JSX,
} from 'react';

import { S } from '../strings';
import { Select } from '../widgets/Select';
import type { FleetWords } from '../words/fleet';
import { Cards, filterText } from './Cards';
import type { Seen } from './follow';
import { alarmCount, chosen, countsOf, FILTERS, groupNames, type Filter } from './sites';
import { ms, timeText } from './times';

// Loaded when somebody asks for them.
const Alarms = lazy(() => import('./Alarms'));
const Compare = lazy(() => import('./Compare'));
const Report = lazy(() => import('./Report'));

const VIEWS = ['sites', 'alarms', 'compare', 'report'] as const;
type View = (typeof VIEWS)[number];

const asked = new URLSearchParams(window.location.search);

interface Props {
  readonly seen: Seen;
  readonly words: FleetWords;
  readonly isKiosk: boolean;
}

export function Overview({ seen, words, isKiosk }: Props): JSX.Element {
  const [view, setView] = useState<View>('sites');
  const [filter, setFilter] = useState<Filter>('all');
  const [search, setSearch] = useState('');
  const [group, setGroup] = useState(asked.get('group') ?? '');
  const field = useRef<HTMLInputElement>(null);
  const sites = useDeferredValue(seen.sites);
  const counts = useMemo(() => countsOf(sites.values()), [sites]);
  const alarms = useMemo(() => alarmCount(sites.values()), [sites]);
  // Before, there is nothing to count.
  const isHere = seen.archive !== null;
  const names = groupNames(sites.values()).join();
  const groups = useMemo(() => (names ? names.split(',') : []), [names]);
  const shown = useMemo(() => chosen(sites, filter, search, group), [sites, filter, search, group]);

  useEffect(() => {
    document.title = alarms === 0 ? words.sites : `(${alarms}) ${words.sites}`;
  }, [alarms, words]);

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
        <h1>{words.sites}</h1>
        {isKiosk && (
          <span className="fleet-alarms" data-any={alarms > 0}>
            {!isHere ? '' : alarms === 0 ? words.noAlarms : S.alarmCount(alarms)}
          </span>
        )}
        {!isKiosk && (
          <>
            <nav className="fleet-filters">
              {VIEWS.map((each) => (
                <button
                  key={each}
                  type="button"
                  aria-pressed={view === each}
                  onClick={() => {
                    setView(each);
                  }}
                >
                  {each === 'alarms' || each === 'report' ? S[each] : words[each]}
                  {each === 'alarms' && (
                    <>
                      {' '}
                      <span className="fleet-count">{isHere && alarms}</span>
                    </>
                  )}
                </button>
              ))}
            </nav>
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
            {groups.length > 0 && (
              <Select
                className="fleet-search"
                aria-label={words.group}
                value={groups.includes(group) ? group : ''}
                options={['', ...groups]}
                text={(name) => name || words.allGroups}
                onChange={setGroup}
              />
            )}
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
                  {filterText(each, words)}{' '}
                  <span className="fleet-count">{isHere && counts[each]}</span>
                </button>
              ))}
            </div>
          </>
        )}
      </header>
      <Trouble seen={seen} words={words} />
      <main aria-label={view === 'alarms' ? words.alarmList : words.list}>
        <p className="unseen" role="status">
          {search || group || filter !== 'all' ? words.shown(shown.length, sites.size) : ''}
        </p>
        {shown.length === 0 ? (
          <p className="fleet-empty">{nothingText(seen, words)}</p>
        ) : view === 'sites' ? (
          <Cards shown={shown} groups={groups} words={words} asOf={asOfWhen(seen)} />
        ) : (
          <Suspense fallback={<p className="fleet-empty">{words.connecting}</p>}>
            {view === 'alarms' && <Alarms shown={shown} words={words} />}
            {view === 'compare' && <Compare shown={shown} words={words} />}
            {view === 'report' && <Report shown={shown} words={words} />}
          </Suspense>
        )}
      </main>
    </div>
  );
}

/** When all of it was last known, ms since the epoch; null: it is as of now. */
function asOfWhen({ archive, lostAt }: Seen): number | null {
  if (lostAt !== null || !archive || archive.is_reachable) return lostAt;
  return archive.since && ms(archive.since);
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
