import type { JSX } from 'react';

import type { TagHistory } from '../contract/types';
import { readingText } from '../domain/format';
import { rangeOf, rgbText, sensorColour } from '../domain/ramp';
import type { Sensor } from '../domain/sensors';
import { S } from '../strings';

type Values = TagHistory['sensors'][number]['values'];

interface SparkPoint {
  readonly x: number;
  readonly y: number;
}

const WIDTH = 96;
const HEIGHT = 26;
const PAD = 3;

/** Points by time along x, oldest first; values of null split the line into pieces. */
export function sparkLines(values: Values): SparkPoint[][] {
  const { low, high } = rangeOf(values.map(({ value }) => value)) ?? { low: 0, high: 0 };
  const seconds = values.map(({ stamp }) => stamp.sec + stamp.nanosec / 1e9);
  const start = seconds[0] ?? 0;
  const length = (seconds.at(-1) ?? 0) - start;
  const pieces: SparkPoint[][] = [];
  let piece: SparkPoint[] = [];
  values.forEach(({ value }, index) => {
    if (value === null) {
      piece = [];
      return;
    }
    if (piece.length === 0) pieces.push(piece);
    // If the clock jumped back, times are no order: space the scans evenly.
    const along =
      length > 0
        ? ((seconds[index] ?? start) - start) / length
        : index / Math.max(1, values.length - 1);
    const up = high > low ? (value - low) / (high - low) : 0.5;
    piece.push({
      x: PAD + Math.min(1, Math.max(0, along)) * (WIDTH - 2 * PAD),
      y: HEIGHT - PAD - up * (HEIGHT - 2 * PAD),
    });
  });
  return pieces;
}

export function Sparkline({
  sensor,
  values,
}: {
  sensor: Sensor;
  values: Values;
}): JSX.Element | null {
  const count = values.filter(({ value }) => value !== null).length;
  const range = rangeOf(values.map(({ value }) => value));
  if (!range || count < 2) return null;
  const label = S.cardHistory(
    count,
    readingText(sensor, range.low),
    readingText(sensor, range.high),
  );
  const pieces = sparkLines(values);
  const last = pieces.at(-1)?.at(-1);
  return (
    <svg
      className="sparkline"
      viewBox={`0 0 ${WIDTH} ${HEIGHT}`}
      width={WIDTH}
      height={HEIGHT}
      role="img"
      aria-label={label}
      style={{ color: rgbText(sensorColour(sensor)) }}
    >
      {pieces.map((piece, index) => (
        <polyline key={index} points={piece.map(({ x, y }) => `${x},${y}`).join(' ')} />
      ))}
      {last && <circle cx={last.x} cy={last.y} r={2.5} />}
    </svg>
  );
}
