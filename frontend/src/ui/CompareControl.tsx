import { useState, type JSX } from 'react';

import { now } from '../clock';
import { differenceText, divergingColours, signedText, type Compare } from '../domain/difference';
import { shown } from '../domain/text';
import { hasDate, rosText, shortRosText } from '../domain/time';
import { act, store, useApp } from '../store/app';
import { selectHeat, selectSensor } from '../store/derived';
import { rosNow, selectDayS } from '../store/moment';
import { S } from '../strings';
import { fieldOf, momentOf } from '../timebar/TimeBar';
import { Select } from '../widgets/controls';

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
  return (
    <div className="compare">
      <label className="layer-choice">
        <span>{S.compare}</span>
        <Select
          value={choiceOf(compare, dayS)}
          data-testid="compare"
          options={CHOICES}
          text={(choice) => S.compareWith[choice]}
          onChange={(choice) => {
            act({ compare: compareFor(choice, dayS) });
          }}
        />
      </label>
      {compare?.by === 'moment' && <OwnMoment at={compare.at} />}
    </div>
  );
}

/** "own" starts at the shown moment: go to the past, choose "own", and return to live. */
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

/** Keeps a half-typed date, which is not valid yet, in the field. */
function OwnMoment({ at }: { at: number }): JSX.Element {
  const inForce = { of: at, text: fieldOf(at, false) };
  const [typed, setTyped] = useState(inForce);
  if (!hasDate(at)) return <span className="faint">{rosText(at)}</span>;
  return (
    <input
      type="datetime-local"
      step={1}
      aria-label={S.compareMoment}
      value={typed.of === at ? typed.text : inForce.text}
      onBlur={() => {
        setTyped(inForce);
      }}
      onChange={(event) => {
        const text = event.target.value;
        const chosen = momentOf(text, false);
        setTyped({ of: chosen ?? at, text });
        if (chosen !== null) act({ compare: { by: 'moment', at: chosen } });
      }}
    />
  );
}

/** Legend of the heat map while it shows a difference; null: it shows none. */
export function DifferenceLegend({ kiosk }: { kiosk: boolean }): JSX.Element | null {
  const compare = useApp((state) => state.view.compare);
  const sensor = useApp(selectSensor);
  const heat = useApp(selectHeat);
  const { value, state: fetched, message } = useApp((state) => state.twin.difference);
  if (!compare) return null;
  const range = heat?.difference ? heat.range : null;
  return (
    <div className="legend-difference" data-testid="difference-legend">
      <div className="legend-title">
        <strong>{S.difference(shown(sensor.label, 32))}</strong>{' '}
        {!kiosk && (
          <button
            type="button"
            className="text-button"
            onClick={() => {
              // The focus must not go with the button: to the menu of the comparison.
              document.querySelector<HTMLElement>('.layers > button')?.focus();
              act({ compare: null });
            }}
          >
            {S.compareEnd}
          </button>
        )}
      </div>
      {range ? (
        <div className="difference-scale">
          <span>{signedText(sensor, range.low)}</span>
          <div
            className="difference-bar"
            aria-hidden="true"
            style={{
              backgroundImage: `linear-gradient(to right, ${divergingColours().join(', ')})`,
            }}
          />
          <span>{differenceText(sensor, range.high)}</span>
        </div>
      ) : (
        <p role="status">
          {fetched === 'failed'
            ? S.differenceFailed(shown(message, 300))
            : value
              ? S.differenceNothing(rosText(Math.max(0, value.against)))
              : S.differenceLoading}
        </p>
      )}
      {range && value && <p className="faint">{timesText(value)}</p>}
    </div>
  );
}

/** Both moments on one line of a phone: the year only where it differs. */
function timesText({ at, against }: { at: number; against: number }): string {
  const isSameYear = yearOf(at) === yearOf(against);
  const text = isSameYear ? shortRosText : rosText;
  return S.differenceTimes(text(at), text(against));
}

const yearOf = (at: number): number => new Date(at * 1000).getFullYear();
