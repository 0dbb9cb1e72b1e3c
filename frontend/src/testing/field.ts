/** Fields, as the page has them and as the server sends them. */
import type { Expected, Field, Grade, Place, Sureness } from '../contract/types';
import { wireTime } from './timeline';

/** These rows of cells, the lowest first, a metre each from the origin on. */
export function fieldWith(rows: readonly (readonly number[])[], over: Partial<Field> = {}): Field {
  const values = rows.flat();
  const known = values.filter((value) => !Number.isNaN(value));
  return {
    sensor: 'temperature',
    width: rows[0]?.length ?? 0,
    height: rows.length,
    originX: 0,
    originY: 0,
    resolution: 1,
    valueMin: Math.min(...known),
    valueMax: Math.max(...known),
    sampleCount: 1,
    values: Float32Array.from(values),
    ...over,
  };
}

/** One row of cells from (-1.5, 0.5) on. */
export function npyField(values: readonly number[]): Response {
  const header = `{'descr': '<f4', 'fortran_order': False, 'shape': (1, ${values.length}), }`;
  const bytes = new Uint8Array(10 + header.length);
  bytes.set([0x93, 0x4e, 0x55, 0x4d, 0x50, 0x59, 1, 0, header.length, 0]);
  bytes.set(new TextEncoder().encode(header), 10);
  const body = new Uint8Array(Float32Array.from(values).buffer);
  const all = new Uint8Array(bytes.length + body.length);
  all.set(bytes);
  all.set(body, bytes.length);
  const headers = {
    'X-Field-Origin-X': '-1.5',
    'X-Field-Origin-Y': '0.5',
    'X-Field-Resolution': '0.05',
    'X-Field-Value-Min': '1',
    'X-Field-Value-Max': '2',
    'X-Field-Sample-Count': '4',
  };
  return new Response(all.buffer, { headers });
}

/** A body as /api/field.npy sends it: version 1, little-endian float32, C order. */
export function npy(height: number, width: number, values: readonly number[]): ArrayBuffer {
  const header = `{'descr': '<f4', 'fortran_order': False, 'shape': (${height}, ${width}), }`;
  const padded = header.padEnd(Math.ceil((10 + header.length + 1) / 64) * 64 - 11) + '\n';
  const buffer = new ArrayBuffer(10 + padded.length + values.length * 4);
  const bytes = new Uint8Array(buffer);
  bytes.set([0x93, ...new TextEncoder().encode('NUMPY'), 1, 0]);
  const view = new DataView(buffer);
  view.setUint16(8, padded.length, true);
  bytes.set(new TextEncoder().encode(padded), 10);
  values.forEach((value, index) => {
    view.setFloat32(10 + padded.length + index * 4, value, true);
  });
  return buffer;
}

/** Estimates and what is said of them, as the server sends them. */

/** One row of cells from (-1.5, 0.5) on, 1 m each: the means, then their standard deviations. */
export function npyEstimate(mean: readonly number[], sd: readonly number[], sdKnown = 1): Response {
  const shape = `(2, 1, ${mean.length})`;
  const header = `{'descr': '<f4', 'fortran_order': False, 'shape': ${shape}, }`;
  const bytes = new Uint8Array(10 + header.length + 8 * mean.length);
  bytes.set([0x93, 0x4e, 0x55, 0x4d, 0x50, 0x59, 1, 0, header.length, 0]);
  bytes.set(new TextEncoder().encode(header), 10);
  bytes.set(new Uint8Array(Float32Array.from([...mean, ...sd]).buffer), 10 + header.length);
  const headers = {
    'X-Estimate-Origin-X': '-1.5',
    'X-Estimate-Origin-Y': '0.5',
    'X-Estimate-Resolution': '1',
    'X-Estimate-Sd-Known': String(sdKnown),
    'X-Estimate-Sample-Count': '4',
    'X-Estimate-Reading-Count': '40',
  };
  return new Response(bytes.buffer, { headers });
}

/** Where nothing surer than 1 is asked. */
export const sureness = (sd: readonly number[]): Sureness => ({
  sd: Float32Array.from(sd),
  sdKnown: 1,
  readingCount: 40,
});

/** A row of cells from the origin on, 1 m each. */
export const estimated = (
  values: readonly number[],
  sd: readonly number[],
  over: Partial<Field> = {},
): Field => ({
  sensor: 'temperature',
  width: values.length,
  height: 1,
  originX: 0,
  originY: 0,
  resolution: 1,
  valueMin: 20,
  valueMax: 30,
  sampleCount: 3,
  values: Float32Array.from(values),
  sureness: sureness(sd),
  ...over,
});

export const grade = (over: Partial<Grade> = {}): Grade => ({
  fitted_at: wireTime(1_000),
  fit_problem: '',
  graded_since: wireTime(500),
  day: { scans: 458, inside: 412 },
  week: { scans: 3_200, inside: 2_900 },
  share_day: 412 / 458,
  share_week: 2_900 / 3_200,
  is_trusted: true,
  ...over,
});

export const expectedReading = (over: Partial<Expected> = {}): Expected => ({
  measured: 22.4,
  observed_at: wireTime(1_000),
  expected: 22.1,
  expected_sd: 0.79,
  z: 0.4,
  offset: 0.3,
  left_out: false,
  ...over,
});

/** What the routes beside the field answer. */
export const bodies = {
  quality: (sensors: Readonly<Record<string, Grade>>): object => ({ sensors }),
  tags: (tags: Readonly<Record<string, object>>): object => ({
    sensor_type: 'temperature',
    at: wireTime(1_000),
    tags,
  }),
  advice: (places: readonly Place[]): object => ({ sensor_type: 'temperature', places }),
};
