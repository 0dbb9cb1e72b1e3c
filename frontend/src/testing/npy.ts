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
