/** Fields, as in the page and as on the wire. */
import type { Field, Sureness } from '../contract/types';

/** A field of these rows, the lowest first, with cells of 1 m from the origin. */
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

/** A body as the routes send it: version 1, little-endian float32, C order. */
export function npy(shape: readonly number[], values: readonly number[]): ArrayBuffer {
  const text = `{'descr': '<f4', 'fortran_order': False, 'shape': (${shape.join(', ')}), }`;
  const header = Uint8Array.of(0x93, ...new TextEncoder().encode(`NUMPY\x01\0`), text.length, 0);
  const body = new Uint8Array(Float32Array.from(values).buffer);
  return Uint8Array.of(...header, ...new TextEncoder().encode(text), ...body).buffer;
}

const npyAnswer = (
  kind: 'Field' | 'Estimate',
  body: ArrayBuffer,
  said: Readonly<Record<string, number>>,
): Response => {
  const all = { 'Origin-X': -1.5, 'Origin-Y': 0.5, 'Sample-Count': 4, ...said };
  const headers = Object.entries(all).map(([end, value]): [string, string] => [
    `X-${kind}-${end}`,
    String(value),
  ]);
  return new Response(body, { headers });
};

/** One row of cells, starting at (-1.5, 0.5). */
export const npyField = (values: readonly number[]): Response =>
  npyAnswer('Field', npy([1, values.length], values), {
    ...{ Resolution: 0.05, 'Value-Min': 1, 'Value-Max': 2 },
  });

/** The same with cells of 1 m: the means, then their standard deviations. */
export const npyEstimate = (
  mean: readonly number[],
  sd: readonly number[],
  sdKnown = 1,
): Response =>
  npyAnswer('Estimate', npy([2, 1, mean.length], [...mean, ...sd]), {
    ...{ Resolution: 1, 'Sd-Known': sdKnown, 'Reading-Count': 40 },
  });

/** With a limit of 1 for known cells. */
export const sureness = (sd: readonly number[]): Sureness => ({
  sd: Float32Array.from(sd),
  sdKnown: 1,
});

/** A row of cells of 1 m, starting at the origin. */
export const estimated = (
  values: readonly number[],
  sd: readonly number[],
  over: Partial<Field> = {},
): Field =>
  fieldWith([values], {
    ...{ valueMin: 20, valueMax: 30, sampleCount: 3 },
    sureness: sureness(sd),
    ...over,
  });
