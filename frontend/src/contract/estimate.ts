/** The routes of the estimate: a field with its error, and what the twin says of how good it is. */
import { fieldParameters, type FieldQuery, get, npyOf, numberIn, read } from './api';
import type { Expected, Grade, Place } from './types';

/** As the server sends it; whatever a cell's error is, its mean is told. */
export interface Estimate {
  readonly width: number;
  readonly height: number;
  readonly originX: number;
  readonly originY: number;
  readonly resolution: number;
  readonly sdKnown: number;
  readonly sampleCount: number;
  readonly readingCount: number;
  /** Row-major, row 0 at the bottom; not-a-number where the house is not explored. */
  readonly mean: Float32Array;
  readonly sd: Float32Array;
}

export async function fetchEstimate(query: FieldQuery, signal: AbortSignal): Promise<Estimate> {
  const response = await get(`api/estimate.npy?${fieldParameters(query)}`, signal);
  const { shape, values } = npyOf(await response.arrayBuffer(), 3);
  const [layers = 0, height = 0, width = 0] = shape;
  if (layers !== 2) throw new Error(`estimate: ${layers} grids, expected mean and sd`);
  const header = numberIn(response);
  return {
    width,
    height,
    originX: header('X-Estimate-Origin-X'),
    originY: header('X-Estimate-Origin-Y'),
    resolution: header('X-Estimate-Resolution'),
    sdKnown: header('X-Estimate-Sd-Known'),
    sampleCount: header('X-Estimate-Sample-Count'),
    readingCount: header('X-Estimate-Reading-Count'),
    mean: values.subarray(0, height * width),
    sd: values.subarray(height * width),
  };
}

/** null: no tag has this sensor. */
export async function fetchGrade(sensor: string, signal: AbortSignal): Promise<Grade | null> {
  const body = await read(
    'EstimateQualities',
    await asked('quality', { sensor_type: sensor }, signal),
  );
  return Object.hasOwn(body.sensors, sensor) ? (body.sensors[sensor] ?? null) : null;
}

export async function fetchExpected(
  sensor: string,
  signal: AbortSignal,
): Promise<Readonly<Record<string, Expected>>> {
  const response = await asked('tags', { sensor_type: sensor }, signal);
  return (await read('ExpectedTags', response)).tags;
}

/** The best first. */
export async function fetchAdvice(
  sensor: string,
  places: number,
  signal: AbortSignal,
): Promise<readonly Place[]> {
  const query = { sensor_type: sensor, places: String(places) };
  const response = await asked('advice', query, signal);
  return (await read('Advice', response)).places;
}

const asked = (
  what: string,
  query: Readonly<Record<string, string>>,
  signal: AbortSignal,
): Promise<Response> =>
  get(`api/estimate/${what}?${new URLSearchParams(query).toString()}`, signal);
