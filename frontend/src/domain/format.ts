import { Refusal } from '../contract/api';
import type { MapPoint } from '../geometry/coordinates';
import { LOCALE, S } from '../strings';
import type { Sensor, Span } from './sensors';

/** The reader's decimal separator. */
const POINT =
  new Intl.NumberFormat(LOCALE).formatToParts(0.5).find(({ type }) => type === 'decimal')?.value ??
  '.';

/** A number's text in the reader's form: their decimal separator, and a true minus sign. */
export const written = (text: string): string => text.replace('.', POINT).replace('-', '\u2212');

/** A number with the given digits, or as precise as its size needs: a small one never reads as 0. */
function roundedText(value: number, digits: number | null): string {
  const size = Math.abs(value);
  if (size >= 1e6) return value.toExponential(2);
  const own = size >= 1 || size === 0 ? 1 : Math.min(6, 1 + Math.ceil(-Math.log10(size)));
  const text = value.toFixed(digits ?? (size >= 100 ? 0 : own));
  return /^-0(\.0+)?$/.test(text) ? text.slice(1) : text;
}

const WHOLE = new Intl.NumberFormat(LOCALE, { maximumFractionDigits: 0 });

/** In the reader's form, with thousands separators, as on a chart's axis. */
export function numberText(value: number, digits: number | null = null): string {
  const text = roundedText(value, digits);
  return Math.abs(Number(text)) >= 1000 && Math.abs(value) < 1e6
    ? WHOLE.format(value).replace('-', '\u2212')
    : written(text);
}

/** A reading without its unit. */
export const valueText = (sensor: Sensor, value: number): string =>
  numberText(toShown(sensor, value), sensor.digits);

/** The difference of two readings, or an error, without its unit. */
export const differenceNumber = (sensor: Sensor, by: number): string =>
  numberText(differenceToShown(sensor, by), sensor.digits);

/** Half the width of an interval of errors: rounded like a value, unless that would round it to zero. */
export function errorNumber(sensor: Sensor, by: number): string {
  const text = differenceNumber(sensor, by);
  return /[1-9]/.test(text) ? text : numberText(differenceToShown(sensor, by));
}

/** A number's text and the sensor's unit, joined by a no-break space. */
export const withUnit = ({ unit }: Sensor, text: string): string =>
  unit ? `${text}\u00a0${unit}` : text;

export const readingText = (sensor: Sensor, value: number): string =>
  withUnit(sensor, valueText(sensor, value));

/** A reading with its unit; if it reads like the limit that it exceeds, the text says on which side it lies. */
export function beyondLimitText(sensor: Sensor, value: number, limit: number): string {
  const text = readingText(sensor, value);
  return value !== limit && text === readingText(sensor, limit)
    ? S.reasons.just[value < limit ? 'below' : 'above'](text)
    : text;
}

/** A range with its unit; an en dash if there is none. */
export function rangeText(sensor: Sensor, range: Span | null): string {
  if (!range) return '–';
  return S.valueRange(valueText(sensor, range[0]), readingText(sensor, range[1]));
}

/** A length of time in at most its two largest units; a second one of 0 is left out. */
export function ageText(seconds: number): string {
  const s = Math.floor(seconds);
  if (s < 60) return `${s}\u00a0s`;
  const minutes = Math.floor(s / 60);
  if (minutes < 60) return `${minutes}\u00a0min`;
  const hours = Math.floor(minutes / 60);
  const [most, rest] =
    hours < 24
      ? [`${hours}\u00a0${S.hours}`, `${minutes % 60}\u00a0min`]
      : [`${Math.floor(hours / 24)}\u00a0d`, `${hours % 24}\u00a0${S.hours}`];
  return rest.startsWith('0') ? most : `${most} ${rest}`;
}

/** An interval between repeated events: exact if short. */
export function intervalText(seconds: number): string {
  if (seconds < 10) return `${written(seconds.toFixed(1))}\u00a0s`;
  const s = Math.round(seconds);
  if (s >= 60 && s < 600 && s % 60 > 0) return `${Math.floor(s / 60)}\u00a0min ${s % 60}\u00a0s`;
  return ageText(s);
}

/** An age in its largest unit alone, for a narrow column. */
export function shortAgeText(seconds: number): string {
  return ageText(seconds).replace(/^(\d+\u00a0\w+) .*$/, '$1');
}

const clock = new Intl.DateTimeFormat(LOCALE, {
  hour: '2-digit',
  minute: '2-digit',
  second: '2-digit',
  hourCycle: 'h23',
});

export function clockText(epochMs: number): string {
  return clock.format(epochMs);
}

/** Without the seconds. */
export const minuteText = (epochMs: number): string => clockText(epochMs).slice(0, -3);

/** Date and time on the operator's own clock, for file names: 2026-05-01 14:03:22. */
export function momentText(epochMs: number): string {
  return new Date(epochMs).toLocaleString('sv-SE');
}

export function percentText(share: number): string {
  return `${Math.round(share * 100)}\u00a0%`;
}

export function metresText(value: number): string {
  return written(value.toFixed(2));
}

export const farOffText = ({ x, y }: MapPoint): string =>
  S.farOffLong(S.position(metresText(x), metresText(y)));

const TIMEOUT = 504;

/** Why a request failed: temporary failures in the reader's language, others as received. */
export function failureText(error: unknown): string {
  // A busy server says when to retry. Without any answer, `fetch` throws a TypeError.
  const isPassing =
    error instanceof Refusal
      ? error.retryAfterS !== null || error.status === TIMEOUT
      : error instanceof TypeError;
  if (isPassing) return S.serverBusy;
  return error instanceof Error ? error.message : String(error);
}

export const toShown = ({ factor, offset }: Sensor, value: number): number =>
  value * factor + offset;

/** A difference of two values as shown: without the offset of 32. */
export const differenceToShown = ({ factor }: Sensor, value: number): number => value * factor;
