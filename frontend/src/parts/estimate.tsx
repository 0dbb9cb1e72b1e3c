import '../styles/estimate.css';

import { type JSX, useEffect } from 'react';

import { answer } from '../contract/api';
import type {
  Advice,
  ExpectedTags,
  Field,
  Grade,
  Place,
  Schemas,
  TagHealth,
} from '../contract/types';
import { cellAt, errorColours, plusMinus } from '../domain/field';
import {
  errorNumber,
  metresText,
  percentText,
  ageText,
  valueText,
  withUnit,
} from '../domain/format';
import type { HouseHealth } from '../domain/health';
import { isMeasured, type Sensor } from '../domain/sensors';
import { shown } from '../domain/text';
import { ageSeconds, type When } from '../domain/time';
import type { Tag } from '../domain/twin';
import { type MapPoint, mapPoint, toCanvas } from '../geometry/coordinates';
import { store, useApp } from '../store/app';
import { selectCatalogue, selectHealth, selectHeat, selectSensor } from '../store/derived';
import { keepClear } from '../store/create';
import { type Fetched, useFetched } from '../store/fetcher';
import { selectShown, selectTags, shownTime } from '../store/moment';
import { LANGUAGE, S } from '../strings';
import { More } from '../widgets/controls';
import { useTicking } from '../widgets/useNow';
import { estimateWordsOf } from '../words/estimate';

/** The shown estimate's uncertainty and prediction record; or why there is no estimate. */
export function EstimateFacts(): JSX.Element {
  const sensor = useApp(selectSensor);
  const field = useApp((state) => selectShown(state).field.value);
  const isNow = useApp((state) => selectShown(state).moment === null);
  const isError = useApp((state) => state.view.heat === 'error');
  const hasTags = useApp((state) => selectTags(state).length > 0);
  const graded =
    useEstimateQuery<Schemas['EstimateQualities']>('quality', 'sensors').value?.sensors ?? {};
  const grade = Object.hasOwn(graded, sensor.name) ? (graded[sensor.name] ?? null) : null;
  if (!isMeasured(sensor)) {
    return (
      <span role="status" className="estimate-missing" data-testid="estimate-missing">
        {E.computed}
      </span>
    );
  }
  const ofSensor = field?.sensor === sensor.name ? field : null;
  if (ofSensor?.noEstimate !== undefined)
    return <Missing why={ofSensor.noEstimate} grade={grade} />;
  // Without a tag, a notice on the map says what is missing.
  if (!ofSensor?.sureness) return <span role="status">{hasTags && E.onItsWay}</span>;
  return (
    <>
      {!isError && (
        <span data-testid="estimate-key">
          {E.unsure(errorText(sensor, ofSensor.sureness.sdKnown))}
        </span>
      )}
      {grade && <Prediction grade={grade} isNow={isNow} />}
    </>
  );
}

function Missing({ why, grade }: { why: string; grade: Grade | null }): JSX.Element {
  const reason = grade?.fit_problem ? E.fitProblem(shown(grade.fit_problem, 160)) : why;
  return (
    <>
      <span role="status" className="estimate-missing" data-testid="estimate-missing">
        {grade?.fitted_at === null ? E.noModel : E.noneNow}
      </span>
      <More label={S.more} text={shown(reason, 300)} />
    </>
  );
}

/** "n of ten" predictions that held; with fewer than ten scans, of their number. */
function predictionText({ day, share_day: share }: Grade): string {
  if (share === null) return E.predictedNone;
  return day.scans < 10
    ? E.predicted(day.inside, day.scans)
    : E.predicted(Math.round(share * 10), 10);
}

function Prediction({ grade, isNow }: { grade: Grade; isNow: boolean }): JSX.Element {
  const least = Math.min(grade.share_day ?? 1, grade.share_week ?? 1);
  const details = [
    E.aboutText,
    ...(grade.fit_problem ? [`${E.fitProblem(shown(grade.fit_problem, 160))}.`] : []),
  ];
  return (
    <>
      {grade.is_trusted === false && (
        <strong role="status" className="estimate-warning" data-testid="estimate-warning">
          {E.notTrusted(Math.floor(least * 10))}
        </strong>
      )}
      {/* The grade is always current: beside a past moment, it would be taken for that moment's. */}
      {isNow && <span data-testid="prediction">{predictionText(grade)}</span>}
      <More label={E.about} text={details.join(' ')} />
    </>
  );
}

/** The estimate at a point with its error, and the number and age of the readings near it. */
export function EstimateReadout({
  point,
  field,
  value,
  isError,
}: {
  point: MapPoint;
  field: Field;
  /** Value of the cell at the point; null: unknown. */
  value: number | null;
  isError: boolean;
}): JSX.Element {
  const sensor = useApp(selectSensor);
  const tags = useApp(selectTags);
  const health = useApp(selectHealth);
  const { count, oldest } = nearTo(point, tags, sensor.name, health);
  const age = useTicking((now) => {
    const seconds = ageSeconds(oldest, shownTime(store.get(), now));
    return seconds === null ? null : ageText(seconds);
  });
  const sd = field.sureness?.sd[cellAt(field, point) ?? -1] ?? NaN;
  const text =
    value === null
      ? S.notKnown
      : isError
        ? `±\u00a0${errorText(sensor, sd)}`
        : estimateText(sensor, value, sd);
  return (
    <>
      <strong>{text}</strong>
      <span data-testid="readout-near">
        {E.near(count)}
        {count > 0 && age !== null && `, ${E.oldest(age)}`}
      </span>
    </>
  );
}

/** Distance within which readings are usually alike, metres. */
export const NEAR_M = 2.5;

/**
 * Number of tags with a reading within `NEAR_M`, and the time of the oldest one; "never": there is none.
 * Readings left out of the estimate do not count.
 */
export function nearTo(
  point: MapPoint,
  tags: readonly Tag[],
  sensor: string,
  { byTag }: Pick<HouseHealth, 'byTag'>,
) {
  const hasChanged = ({ id }: Tag): boolean =>
    byTag.get(id)?.reasons.some((each) => each.kind === 'changed' && each.sensor === sensor) ??
    false;
  const near = tags.filter(
    (tag) =>
      tag.at &&
      tag.readings.get(sensor) != null &&
      Math.hypot(tag.at.x - point.x, tag.at.y - point.y) <= NEAR_M &&
      !hasChanged(tag),
  );
  const times = near.map(({ readAt }) => readAt.get(sensor) ?? 'unknown');
  const known = times.filter((when) => typeof when === 'number');
  const oldest = known.length < times.length ? 'unknown' : Math.min(...known);
  const when: When = near.length === 0 ? 'never' : oldest;
  return { count: near.length, oldest: when };
}

export function ErrorScale(): JSX.Element {
  const sensor = useApp(selectSensor);
  const most = useApp((state) => selectHeat(state)?.range.high ?? 0);
  return (
    <div data-testid="error-scale">
      <div
        className="difference-bar"
        aria-hidden="true"
        style={{ backgroundImage: `linear-gradient(to right, ${errorColours().join(', ')})` }}
      />
      <div className="difference-ends">
        <span>±{'\u00a0'}0</span>
        <strong>{E.error}</strong>
        <span data-testid="error-high">
          ±{'\u00a0'}
          {withUnit(sensor, errorNumber(sensor, most))}
        </span>
      </div>
    </div>
  );
}

/** A tag's reading beside the estimate from all other readings, and readings left out of the estimate. */
export function CardEstimate({
  tag,
  health,
}: {
  tag: Tag;
  health: TagHealth | undefined;
}): JSX.Element | null {
  const sensor = useApp(selectSensor);
  const catalogue = useApp(selectCatalogue);
  // Expected values exist for now only.
  const isNow = useApp((state) => selectShown(state).moment === null);
  const expected = useEstimateQuery<ExpectedTags>('tags', 'tags').value?.tags ?? {};
  const own = isNow && Object.hasOwn(expected, tag.id) ? expected[tag.id] : undefined;
  const changed = new Set(
    (health?.reasons ?? []).filter(({ kind }) => kind === 'changed').map((each) => each.sensor),
  );
  if (own?.left_out) changed.add(sensor.name);
  if (!own && changed.size === 0) return null;
  return (
    <div className="card-estimate" data-testid="card-estimate">
      {own && (
        <p>
          {shown(sensor.label, 32)}:{' '}
          {E.expected(
            valueText(sensor, own.measured),
            estimateText(sensor, own.expected, own.expected_sd),
          )}
        </p>
      )}
      {[...changed].map((name) => (
        <p key={name} data-left-out={name}>
          {E.leftOut(shown(catalogue.named(name).label, 32))}
        </p>
      ))}
    </div>
  );
}

/** Number of suggested places: few buy more sensors at once. */
const PLACES = 5;
/** Half of a mark and its gap to a label, pixels. */
const MARK_PX = 16;

/** Where another tag would help: numbers on the map, a list for screen readers. */
export function AdviceMarks(): JSX.Element {
  const isNow = useApp((state) => selectShown(state).moment === null);
  const { value, state, message } = useEstimateQuery<Advice>('advice', 'places', PLACES);
  const { scale } = useApp((shownIn) => shownIn.viewport.view);
  const places = isNow ? value?.places : undefined;
  useEffect(() => {
    const marks = (places ?? []).map((place) => ({
      left: place.x * scale - MARK_PX,
      top: -place.y * scale - MARK_PX,
      right: place.x * scale + MARK_PX,
      bottom: -place.y * scale + MARK_PX,
    }));
    return keepClear(marks);
  }, [places, scale]);
  if (!isNow) return <Note text={E.adviceNow} />;
  if (!value) {
    return <Note text={state === 'failed' ? E.adviceFailed(shown(message, 160)) : ''} />;
  }
  if (value.places.length === 0) return <Note text={E.adviceNone} />;
  return (
    <ol className="advice" aria-label={S.layers.advice} data-testid="advice">
      {value.places.map((place, index) => (
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
      {/* A button, so that the keyboard reaches the text that a mouse shows by hovering. */}
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

/** Half the width of the 90 % interval: "1.3 °C". */
export const errorText = (sensor: Sensor, sd: number): string =>
  withUnit(sensor, errorNumber(sensor, plusMinus(sd)));

/** "22.4 ± 1.3 °C". */
export const estimateText = (sensor: Sensor, mean: number, sd: number): string =>
  withUnit(sensor, `${valueText(sensor, mean)}\u00a0±\u00a0${errorNumber(sensor, plusMinus(sd))}`);

/** Polling interval: the twin's answers about its estimate change slowly. */
const EVERY_MS = 10_000;

/**
 * The bridge's answer about the shown sensor, polled over HTTP while connected, one request at a time.
 * The answer about another sensor is dropped.
 */
function useEstimateQuery<T extends object>(
  what: string,
  needs: keyof T & string,
  places?: number,
): Fetched<T> {
  const sensor = useApp((state) => state.view.sensor);
  const isOpen = useApp((state) => state.twin.connection.socket.kind === 'open');
  const turn = useTicking((at) => String(Math.floor(at / EVERY_MS)));
  const { value, ...rest } = useFetched<{ readonly of: string; readonly result: T }>(
    isOpen
      ? {
          key: turn,
          group: sensor,
          run: async (signal) => {
            const query = { sensor_type: sensor, places };
            return {
              of: sensor,
              result: await answer<T>(signal, `api/estimate/${what}`, [needs], query),
            };
          },
        }
      : null,
    EVERY_MS,
  );
  return { ...rest, value: value?.of === sensor ? value.result : null };
}

const E = await estimateWordsOf(LANGUAGE);
