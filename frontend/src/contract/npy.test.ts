import { describe, expect, test } from 'vitest';

import { npyOf, parseNpy } from './api';

function npy(header: string, values: readonly number[], version = 1): ArrayBuffer {
  const prefix = version === 1 ? 10 : 12;
  const text = header + ' '.repeat((64 - ((prefix + header.length + 1) % 64)) % 64) + '\n';
  const buffer = new ArrayBuffer(prefix + text.length + values.length * 4);
  const view = new DataView(buffer);
  new Uint8Array(buffer).set([0x93, 0x4e, 0x55, 0x4d, 0x50, 0x59, version, 0]);
  if (version === 1) view.setUint16(8, text.length, true);
  else view.setUint32(8, text.length, true);
  new Uint8Array(buffer).set(new TextEncoder().encode(text), prefix);
  values.forEach((value, i) => {
    view.setFloat32(prefix + text.length + i * 4, value, true);
  });
  return buffer;
}

const HEADER = "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }";

describe('npy', () => {
  test.each([1, 2])('version %d: rows, columns and values, NaN as NaN', (version) => {
    const grid = parseNpy(npy(HEADER, [1, 2, 3, NaN, 5, 6.5], version));
    expect(grid).toMatchObject({ height: 2, width: 3 });
    expect([...grid.values]).toEqual([1, 2, 3, NaN, 5, 6.5]);
  });

  test('as many dimensions as are asked for', () => {
    const three = npy(HEADER.replace('(2, 3)', '(2, 1, 3)'), [1, 2, 3, NaN, 5, 6.5]);
    expect(npyOf(three, 3).shape).toEqual([2, 1, 3]);
    expect(() => npyOf(three, 2)).toThrow('expected 2 dimensions');
  });

  test.each([
    ['magic', npy(HEADER, [1, 2, 3, 4, 5, 6]).slice(1), /magic/],
    ['type', npy(HEADER.replace('<f4', '<f8'), [1, 2, 3, 4, 5, 6]), /<f8/],
    ['order', npy(HEADER.replace('False', 'True'), [1, 2, 3, 4, 5, 6]), /order/],
    ['dimensions', npy(HEADER.replace('(2, 3)', '(6,)'), [1, 2, 3, 4, 5, 6]), /2 dimensions/],
    ['length', npy(HEADER, [1, 2, 3]), /12 bytes .* 2 x 3/],
    ['stump', new Uint8Array([0x93, 0x4e, 0x55, 0x4d, 0x50, 0x59, 1, 0]).buffer, /8 bytes/],
  ])('refuses a wrong %s', (_, buffer, message) => {
    expect(() => parseNpy(buffer)).toThrow(message);
  });
});
