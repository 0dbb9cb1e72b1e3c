import { type JSX, type ReactNode, useState } from 'react';

import { momentText } from '../domain/format';
import { shown } from '../domain/text';
import { countText, hasDate, type Period, PERIOD_KINDS, shortRosText } from '../domain/time';
import { NoteMarks } from '../notes/NoteMarks';
import { SiteComment } from '../notes/Comments';
import { act, store, useApp } from '../store/app';
import { useSelected } from '../store/create';
import { barSpan, latestWord, rosNow, selectIsDisconnected } from '../store/moment';
import { S } from '../strings';
import { Disclosure, Select } from '../widgets/controls';
import { useNow } from '../widgets/useNow';
import { Slider } from './Slider';
import { chooseSpeed, playback, SPEEDS, togglePlayback } from './playback';

/** The time bar below the map: what happened when, and a slider to other moments. */
export function TimeBar(): JSX.Element | null {
  const remembered = useApp((state) => state.twin.remembered);
  const period = useApp((state) => state.view.period);
  // Then the banner, or the line about the journal, says why.
  const isReported = useApp(
    (state) =>
      selectIsDisconnected(state) ||
      Object.hasOwn(S.journal, state.twin.connection.status?.journal.state ?? ''),
  );
  const tick = useNow();
  const nowS = rosNow(store.get(), tick);
  if (nowS === null) return null;
  const span = barSpan(store.get(), nowS);
  return (
    <section
      className="timebar"
      aria-label={S.timebar}
      data-testid="timebar"
      data-state={remembered.state}
    >
      <div className="timebar-tools">
        <Player />
        <When />
        <PeriodChoice period={period} nowS={nowS} />
        <Marks />
        <SiteComment />
      </div>
      {period.kind === 'own' && <OwnPeriod period={period} isSimulated={!hasDate(nowS)} />}
      <NoteMarks span={span} />
      <Slider span={span} timeline={remembered.value} nowS={nowS} />
      {remembered.state === 'failed' && !isReported && (
        <p className="timebar-note" role="status">
          {S.chartFailed(shown(remembered.message, 160))}
        </p>
      )}
    </section>
  );
}

function Player(): JSX.Element {
  const { isPlaying, speed } = useSelected(playback);
  const isNow = useApp((state) => state.view.moment === null);
  const label = isPlaying ? S.timebarPause : S.timebarPlay;
  return (
    <>
      <button
        type="button"
        className="timebar-play"
        aria-label={label}
        title={label}
        aria-pressed={isPlaying}
        onClick={togglePlayback}
      >
        <svg viewBox="0 0 16 16" width="16" height="16" aria-hidden="true">
          <path d={isPlaying ? 'M4 3h3v10H4zM9 3h3v10H9z' : 'M4 2.5v11l9-5.5z'} />
        </svg>
      </button>
      {!isNow && (
        <Select
          aria-label={S.timebarSpeed}
          title={S.timebarSpeed}
          value={speed}
          options={SPEEDS}
          text={(each) => `${each}×`}
          onChange={chooseSpeed}
        />
      )}
    </>
  );
}

/** The chosen moment, which may still be loading; without its year, which the header has. */
function When(): JSX.Element {
  const moment = useApp((state) => state.view.moment);
  const word = useApp(latestWord);
  return (
    <span className="timebar-when" data-testid="timebar-when">
      {moment === null ? word : shortRosText(moment)}
    </span>
  );
}

function PeriodChoice({ period, nowS }: { period: Period; nowS: number }): JSX.Element {
  return (
    <Select
      aria-label={S.timebarPeriod}
      title={S.timebarPeriod}
      value={period.kind}
      options={[...PERIOD_KINDS, 'own'] as const}
      text={(kind) => S.timebarPeriods[kind]}
      onChange={(kind) => {
        // An own period starts as the visible span.
        const { from, to } = barSpan(store.get(), nowS);
        const own = { kind: 'own', from: Math.floor(from), to: Math.ceil(to) } as const;
        act({ period: kind === 'own' ? own : { kind } });
      }}
    />
  );
}

function Marks(): JSX.Element {
  const mark = (name: keyof typeof S.timebarMark, picture: ReactNode): JSX.Element => (
    <li>
      <svg viewBox="0 0 16 16" width="16" height="16" aria-hidden="true" data-mark={name}>
        {picture}
      </svg>
      {S.timebarMark[name]}
    </li>
  );
  return (
    <Disclosure
      label={S.timebarMarks}
      className="timebar-marks"
      button={<span aria-hidden="true">?</span>}
    >
      <ul>
        {mark('scans', <path d="M2 14V8h3v6zM6 14V3h3v11zM10 14v-4h3v4z" />)}
        {mark('failures', <path d="M2 2h3v6H2zM6 2h3v11H6zM10 2h3v4h-3z" />)}
        {mark('pest', <path d="M2 3h12L8 14z" />)}
        {mark('cleared', <circle cx="8" cy="8" r="5" />)}
        {mark('silence', <path d="M0 8l8 8M0 0l16 16M8 0l8 8" />)}
        {mark('before', <path d="M0 8l8-8M0 16L16 0M8 16l8-8" />)}
        {mark('run', <path d="M8 0v16" strokeDasharray="4 3" />)}
      </ul>
    </Disclosure>
  );
}

type Own = Extract<Period, { kind: 'own' }>;

type Typed = Readonly<Record<'from' | 'to', string>>;

/**
 * The typed period; null: invalid. An end that still reads as in `last` stays exact: a text has no
 * fractions, and names two moments in the hour that comes twice in autumn.
 */
function periodOf(typed: Typed, last: Own, isSimulated: boolean): Own | null {
  const end = (name: keyof Typed): number | null =>
    typed[name] === fieldOf(last[name], isSimulated)
      ? last[name]
      : momentOf(typed[name], isSimulated);
  const [from, to] = [end('from'), end('to')];
  return from === null || to === null || from >= to ? null : { kind: 'own', from, to };
}

/** Fields for an own period; an invalid one is not applied, and says so. */
function OwnPeriod({ period, isSimulated }: { period: Own; isSimulated: boolean }): JSX.Element {
  const inForce = {
    of: period,
    from: fieldOf(period.from, isSimulated),
    to: fieldOf(period.to, isSimulated),
  };
  const [last, setTyped] = useState(inForce);
  // A chart or link may have set another period since.
  const typed = last.of === period ? last : inForce;
  const isPeriod = periodOf(typed, period, isSimulated) !== null;
  const take = (next: Typed): void => {
    const own = periodOf(next, period, isSimulated);
    setTyped({ ...next, of: own ?? period });
    if (own) act({ period: own });
  };
  const input = (name: keyof Typed, label: string): JSX.Element => (
    <label>
      <span>{label}</span>
      <input
        type={isSimulated ? 'text' : 'datetime-local'}
        step={isSimulated ? undefined : 1}
        placeholder={isSimulated ? 'hh:mm:ss' : undefined}
        value={typed[name]}
        aria-invalid={!isPeriod}
        onChange={(event) => take({ ...typed, [name]: event.target.value })}
      />
    </label>
  );
  return (
    <div className="timebar-own">
      {input('from', S.timebarFrom)}
      {input('to', S.timebarTo)}
      {!isPeriod && (
        <span role="status">{isSimulated ? S.timebarOwnSimHint : S.timebarOwnHint}</span>
      )}
    </div>
  );
}

/** "2026-11-14T03:12:40" in local time; in a simulation "1:02:03". */
export const fieldOf = (at: number, isSimulated: boolean): string =>
  isSimulated ? countText(at) : momentText(Math.floor(at) * 1000).replace(' ', 'T');

/** The typed time, ROS seconds; null: invalid. */
export function momentOf(text: string, isSimulated: boolean): number | null {
  if (isSimulated) {
    const parts = /^(\d{1,6}):([0-5]\d)(?::([0-5]\d))?$/.exec(text.trim());
    if (!parts) return null;
    return Number(parts[1]) * 3_600 + Number(parts[2]) * 60 + Number(parts[3] ?? 0);
  }
  const epochMs = /^\d{4,6}-\d\d-\d\dT/.test(text) ? new Date(text).getTime() : NaN;
  return Number.isFinite(epochMs) && epochMs >= 0 ? epochMs / 1000 : null;
}
