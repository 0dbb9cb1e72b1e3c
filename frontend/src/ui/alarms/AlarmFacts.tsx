import type { JSX } from 'react';

import {
  lengthOf,
  resolvedText,
  sinceText,
  spanText,
  unknownText,
  valuesOf,
  type Now,
  type Values,
} from '../../alarms/words';
import { selectNow } from '../../alarms/latest';
import type { Alarm, Verdict } from '../../contract/types';
import { ageSeconds } from '../../domain/time';
import { C } from '../../notes/NoteMarks';
import { store, useApp, useContent } from '../../store/app';
import { useSelected } from '../../store/create';
import { selectKnownSince } from '../../alarms/latest';
import { hourAgo, shortHourText } from '../../store/hourAgo';
import { selectCatalogue } from '../../store/derived';
import {
  isReceivingNow,
  latestTime,
  rosNow,
  selectClockFault,
  selectHasTime,
} from '../../store/moment';
import { S } from '../../strings';
import { useTicking } from '../../widgets/useNow';
import { HealthMark } from '../HealthMark';
import { Trend } from '../Trend';

interface ValuesNow extends Values {
  readonly state: Now | null;
}

/** An alarm's values in the latest state. */
export function useValues(alarm: Alarm): ValuesNow {
  const last = useSelected(hourAgo);
  const sensors = useApp(selectCatalogue);
  const state = useContent((shown) => selectNow(shown, alarm, last));
  const values = valuesOf(alarm, sensors, state);
  // As in the banner.
  const fault = useApp(selectClockFault);
  const todo = fault && alarm.reason.kind === 'silent' ? S.clockTodo[fault] : values.todo;
  return { ...values, todo, state };
}

/** Verdict, and since when the alarm is active, not since when it is back to normal; of a resolved alarm, for how long and until when. */
export function AlarmTimes({
  alarm,
  first,
  verdict,
  isOver = false,
}: {
  alarm: Alarm;
  first: string | null;
  verdict: Verdict;
  isOver?: boolean;
}): JSX.Element {
  const nowOf = (at: number): number | null => rosNow(store.get(), at);
  const known = useApp(selectKnownSince);
  const span = useTicking((at) => spanText(alarm, nowOf(at), known));
  const text = useTicking((at) =>
    isOver ? resolvedText(alarm, nowOf(at)) : sinceText(alarm, nowOf(at), known),
  );
  const length = useTicking((at) =>
    verdict === 'healthy' && !isOver ? '' : lengthOf(alarm, nowOf(at), known),
  );
  return (
    <span
      className="alarm-times"
      data-fact="since"
      title={[span, first].filter((each) => each !== null).join(', ')}
    >
      <span>
        {verdict === 'healthy' && `${C.alarm('')} `}
        {text} {length !== '' && <span className="alarm-length">({length}) </span>}
      </span>
      <HealthMark verdict={verdict} text={verdict === 'healthy' ? S.alarmBack : undefined} />
    </span>
  );
}

/** What to do. Old values ask for nothing: only the line stays, so that no row moves. */
export function AlarmTodo({
  text,
  isAgain = false,
  isOfSilence = false,
}: {
  text: string;
  /** Whether it differs from that of the alarm's heading. */
  isAgain?: boolean;
  isOfSilence?: boolean;
}): JSX.Element {
  const isCurrent = useApp(isReceivingNow) || isOfSilence;
  return (
    <span
      className="alarm-do"
      data-again={isAgain || undefined}
      style={isCurrent ? undefined : { visibility: 'hidden' }}
    >
      {text}
    </span>
  );
}

/** The value now above the worst value, aligned in one column of the list. */
export function AlarmFacts({
  alarm,
  values: { state, now: current, worst },
  of = '',
}: {
  alarm: Alarm;
  values: ValuesNow;
  /** Of a heading: whose values these are. */
  of?: string;
}): JSX.Element {
  const sensors = useApp(selectCatalogue);
  return (
    <span className="alarm-values">
      {of !== '' && (state !== null || worst !== null) && <span data-fact="of">{of}</span>}
      {state?.kind === 'known' && current !== null && (
        <Fact name="now" verdict={state.verdict} text={current}>
          {state.value !== null && state.trend !== null && (
            <Trend
              sensor={sensors.named(alarm.reason.sensor)}
              by={state.trend}
              hour={shortHourText()}
            />
          )}
        </Fact>
      )}
      {state?.kind === 'unknown' && (
        <NotKnown alarm={alarm} state={state} hasLast={worst === null} />
      )}
      {worst !== null && <Fact name="worst" verdict={alarm.reason.verdict} text={worst} />}
    </span>
  );
}

function Fact({
  name,
  verdict,
  text,
  children,
}: {
  name: 'now' | 'worst';
  verdict: Verdict;
  text: string;
  children?: JSX.Element | false;
}): JSX.Element {
  return (
    <span data-fact={name} data-status={verdict} title={text}>
      <span>
        {/* The row itself already marks the verdict now. */}
        {name === 'worst' && <HealthMark verdict={verdict} word={false} />} {text}
      </span>
      {children && <> {children}</>}
    </span>
  );
}

/** The last received value, if it says nothing about now. */
function NotKnown({
  alarm,
  state,
  hasLast,
}: {
  alarm: Alarm;
  state: Extract<Now, { kind: 'unknown' }>;
  hasLast: boolean;
}): JSX.Element {
  const sensors = useApp(selectCatalogue);
  // After a lapse no age is known, at once.
  useApp(selectHasTime);
  const text = useTicking((at) =>
    unknownText(alarm, sensors, state, ageSeconds(state.lastAt, latestTime(store.get(), at))),
  );
  return (
    // Never more lines than a known value: then no row grows.
    <span data-fact="now" data-status="unknown" title={text}>
      <span>
        {hasLast ? unknownText(alarm, sensors, state, null) : S.alarmNowUnknown(null, null)}
      </span>
    </span>
  );
}
