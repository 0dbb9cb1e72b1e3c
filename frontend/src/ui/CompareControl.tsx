import type { JSX } from 'react';

import { now } from '../clock';
import type { Compare } from '../domain/difference';
import { hasDate, rosText } from '../domain/rostime';
import { act, store, useApp } from '../store/app';
import { rosNow } from '../store/moment';
import { selectDayS } from '../store/origin';
import { S } from '../strings';

const CHOICES = ['none', 'day', 'week', 'own'] as const;
type Choice = (typeof CHOICES)[number];

function choiceOf(compare: Compare | null, dayS: number): Choice {
  if (compare === null) return 'none';
  if (compare.by === 'moment') return 'own';
  return compare.seconds === dayS ? 'day' : compare.seconds === 7 * dayS ? 'week' : 'own';
}

/** What the heat map is compared with: the same hour of another day, or one moment. */
export function CompareControl(): JSX.Element {
  const compare = useApp((state) => state.view.compare);
  const dayS = useApp(selectDayS);
  const choose = (choice: Choice): void => {
    act({ type: 'compare', compare: compareFor(choice, dayS) });
  };
  return (
    <div className="compare">
      <label>
        <span>{S.compare}</span>
        <select
          value={choiceOf(compare, dayS)}
          data-testid="compare"
          onChange={(event) => {
            choose(event.target.value as Choice);
          }}
        >
          {CHOICES.map((choice) => (
            <option key={choice} value={choice}>
              {S.compareWith[choice]}
            </option>
          ))}
        </select>
      </label>
      {compare?.by === 'moment' && <OwnMoment at={compare.at} />}
    </div>
  );
}

/** "own" begins with the moment that is shown: look back, choose it, and go back to now. */
function compareFor(choice: Choice, dayS: number): Compare | null {
  switch (choice) {
    case 'none':
      return null;
    case 'day':
      return { by: 'ago', seconds: dayS };
    case 'week':
      return { by: 'ago', seconds: 7 * dayS };
    case 'own': {
      const at = store.get().view.moment ?? rosNow(store.get(), now());
      return at === null ? null : { by: 'moment', at };
    }
  }
}

function OwnMoment({ at }: { at: number }): JSX.Element {
  if (!hasDate(at)) return <span className="faint">{rosText(at)}</span>;
  return (
    <input
      type="datetime-local"
      step={1}
      aria-label={S.compareMoment}
      value={localText(at)}
      onChange={(event) => {
        const chosen = new Date(event.target.value).getTime() / 1000;
        if (chosen >= 0) act({ type: 'compare', compare: { by: 'moment', at: chosen } });
      }}
    />
  );
}

/** As the field wants it, on the operator's own clock: 2026-11-21T14:05:00. */
function localText(at: number): string {
  const date = new Date(Math.floor(at) * 1000);
  const local = new Date(date.getTime() - date.getTimezoneOffset() * 60_000);
  return local.toISOString().slice(0, 19);
}
