import { lazy, Suspense, type JSX } from 'react';

import { PERIOD_KINDS, type Period } from '../domain/period';
import { hasDate, rosText } from '../domain/rostime';
import { shown } from '../domain/text';
import { act, store, useApp } from '../store/app';
import { useSelected } from '../store/create';
import { rosNow } from '../store/moment';
import { S } from '../strings';
import type * as Parts from '../notes/parts';
import { useNow } from '../widgets/useNow';
import { Marks } from './Marks';
import { newestWord } from './newest';
import { OwnPeriod } from './OwnPeriod';
import { chooseSpeed, playback, SPEEDS, togglePlayback } from './playback';
import { Slider } from './Slider';
import { barSpan } from './span';

// Where they do not come, the bar goes on without.
type Shown = Pick<typeof Parts, 'CommentMarks' | 'SiteComment'>;
const NOTHING: Shown = { CommentMarks: () => null, SiteComment: () => null };
const parts = (): Promise<Shown> => import('../notes/parts').catch(() => NOTHING);
const CommentMarks = lazy(async () => ({ default: (await parts()).CommentMarks }));
const SiteComment = lazy(async () => ({ default: (await parts()).SiteComment }));

/** Under the map: when what happened, and the way to another moment. */
export function TimeBar(): JSX.Element | null {
  const remembered = useApp((state) => state.twin.remembered);
  const period = useApp((state) => state.view.period);
  const tick = useNow();
  const nowS = rosNow(store.get(), tick);
  if (nowS === null) return null;
  if (remembered.state === 'off') return <Off />;
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
        <Suspense>
          <SiteComment />
        </Suspense>
      </div>
      {period.kind === 'own' && <OwnPeriod period={period} isSimulated={!hasDate(nowS)} />}
      <Suspense>
        <CommentMarks span={span} />
      </Suspense>
      <Slider span={span} timeline={remembered.value} nowS={nowS} />
      {remembered.state === 'failed' && (
        <p className="timebar-note" role="status">
          {S.timebarFailed(shown(remembered.message, 160))}
        </p>
      )}
    </section>
  );
}

/** A twin that keeps nothing: what is missing, and how to have it. */
function Off(): JSX.Element {
  return (
    <section className="timebar" aria-label={S.timebar} data-testid="timebar" data-state="off">
      <p className="timebar-note">
        <strong>{S.timebarOff}</strong> {S.timebarOffHint}
      </p>
    </section>
  );
}

function Player(): JSX.Element {
  const { isPlaying, speed } = useSelected(playback, (state) => state);
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
      <select
        aria-label={S.timebarSpeed}
        title={S.timebarSpeed}
        value={speed}
        onChange={(event) => {
          const chosen = SPEEDS.find((each) => String(each) === event.target.value);
          if (chosen) chooseSpeed(chosen);
        }}
      >
        {SPEEDS.map((each) => (
          <option key={each} value={each}>
            {S.timebarSpeeds(each)}
          </option>
        ))}
      </select>
    </>
  );
}

/** Where the bar stands: the moment that is wanted, which may still be on its way. */
function When(): JSX.Element {
  const moment = useApp((state) => state.view.moment);
  const word = useApp(newestWord);
  return (
    <span className="timebar-when" data-testid="timebar-when">
      {moment === null ? word : rosText(moment)}
    </span>
  );
}

function PeriodChoice({ period, nowS }: { period: Period; nowS: number }): JSX.Element {
  return (
    <select
      className="timebar-period"
      aria-label={S.timebarPeriod}
      title={S.timebarPeriod}
      value={period.kind}
      onChange={(event) => {
        const kind = PERIOD_KINDS.find((each) => each === event.target.value);
        // An own period begins as what is in view.
        const { from, to } = barSpan(store.get(), nowS);
        const own = { kind: 'own', from: Math.floor(from), to: Math.ceil(to) } as const;
        act({ type: 'period', period: kind ? { kind } : own });
      }}
    >
      {[...PERIOD_KINDS, 'own' as const].map((kind) => (
        <option key={kind} value={kind}>
          {S.timebarPeriods[kind]}
        </option>
      ))}
    </select>
  );
}
