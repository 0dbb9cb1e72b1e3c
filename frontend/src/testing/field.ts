/** Fields, as the page has them and as the server sends them. */
import type { Field } from '../contract/types';

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
