import type { Range } from './ramp';
import type { Sensor } from './sensors';
import { toShown, unitOf, type TemperatureUnit } from './units';

/** A number at the precision that a climate sensor deserves, with a true minus sign. */
export function numberText(value: number): string {
  const size = Math.abs(value);
  const digits = size >= 1e6 ? null : size >= 100 ? 0 : size >= 1 || value === 0 ? 1 : 2;
  const text = digits === null ? value.toExponential(2) : value.toFixed(digits);
  return (/^-0(\.0+)?$/.test(text) ? text.slice(1) : text).replace('-', '\u2212');
}

/** A reading without its unit. */
export function valueText(sensor: Sensor, value: number, unit: TemperatureUnit): string {
  return numberText(toShown(sensor, value, unit));
}

/** A reading with its unit, held together by a no-break space. */
export function readingText(sensor: Sensor, value: number, unit: TemperatureUnit): string {
  const suffix = unitOf(sensor, unit);
  const number = valueText(sensor, value, unit);
  return suffix ? `${number}\u00a0${suffix}` : number;
}

/** A range with its unit; an en dash where there is none. */
export function rangeText(sensor: Sensor, range: Range | null, unit: TemperatureUnit): string {
  if (!range) return '–';
  return `${valueText(sensor, range.low, unit)} – ${readingText(sensor, range.high, unit)}`;
}

/** An age in its two largest units at most. */
export function ageText(seconds: number): string {
  const s = Math.floor(seconds);
  if (s < 60) return `${s}\u00a0s`;
  const minutes = Math.floor(s / 60);
  if (minutes < 60) return `${minutes}\u00a0min`;
  const hours = Math.floor(minutes / 60);
  if (hours < 24) return `${hours}\u00a0h ${minutes % 60}\u00a0min`;
  return `${Math.floor(hours / 24)}\u00a0d ${hours % 24}\u00a0h`;
}

/** An age in its largest unit alone, for a narrow column. */
export function shortAgeText(seconds: number): string {
  return ageText(seconds).replace(/^(\d+\u00a0\w+) .*$/, '$1');
}

const clock = new Intl.DateTimeFormat('en-GB', {
  hour: '2-digit',
  minute: '2-digit',
  second: '2-digit',
});

/** Time of day on the operator's own clock. */
export function clockText(epochMs: number): string {
  return clock.format(epochMs);
}

/** Date and time of day on the operator's own clock: 2026-05-01 14:03:22. */
export function momentText(epochMs: number): string {
  return `${new Date(epochMs).toLocaleDateString('en-CA')} ${clockText(epochMs)}`;
}

export function percentText(share: number): string {
  return `${Math.round(share * 100)}\u00a0%`;
}

export function metresText(value: number): string {
  return value.toFixed(2).replace('-', '\u2212');
}
