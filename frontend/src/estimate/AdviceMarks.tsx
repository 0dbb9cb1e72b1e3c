import type { JSX } from 'react';

import { fetchAdvice } from '../contract/estimate';
import type { Place } from '../contract/types';
import { metresText, percentText } from '../domain/format';
import { shown } from '../domain/text';
import { mapPoint, toCanvas } from '../geometry/coordinates';
import { useApp } from '../store/app';
import { selectShown } from '../store/moment';
import { S } from '../strings';
import { useAsked } from './useAsked';
import { E } from './words';

/** More nobody buys at once. */
const PLACES = 5;

const ask = (sensor: string, signal: AbortSignal): Promise<readonly Place[]> =>
  fetchAdvice(sensor, PLACES, signal);

/** Where another tag would help: numbers on the map, which are a list to who does not see it. */
export function AdviceMarks(): JSX.Element {
  const isNow = useApp((state) => selectShown(state).moment === null);
  const { value, state, message } = useAsked(ask);
  if (!isNow) return <Note text={E.adviceNow} />;
  if (!value) {
    return <Note text={state === 'failed' ? E.adviceFailed(shown(message, 160)) : ''} />;
  }
  if (value.length === 0) return <Note text={E.adviceNone} />;
  return (
    <ol className="advice" aria-label={E.advice} data-testid="advice">
      {value.map((place, index) => (
        <Mark key={index} place={place} number={index + 1} />
      ))}
    </ol>
  );
}

function Mark({ place, number }: { place: Place; number: number }): JSX.Element {
  const view = useApp((state) => state.viewport.view);
  const { width, height } = useApp((state) => state.viewport.size);
  const { x, y } = toCanvas(view, mapPoint(place.x, place.y));
  const isInView = x >= 0 && y >= 0 && x <= width && y <= height;
  const text = E.advised(
    S.position(metresText(place.x), metresText(place.y)),
    percentText(place.error_ratio),
    number === 1,
  );
  return (
    <li
      style={{ transform: `translate(${Math.round(x)}px, ${Math.round(y)}px)` }}
      data-side={x > width / 2 ? 'left' : 'right'}
      data-in-view={isInView}
    >
      {/* A button, so that the keyboard comes to what a mouse that rests on it is told. */}
      <button type="button" aria-label={`${number}. ${text}`}>
        <span aria-hidden="true">{number}</span>
      </button>
      <span className="advice-text" aria-hidden="true">
        {text}
      </span>
    </li>
  );
}

const Note = ({ text }: { text: string }): JSX.Element => (
  <p className="advice-note" role="status" data-testid="advice-note">
    {text}
  </p>
);
