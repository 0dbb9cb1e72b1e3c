/**
 * Reader for the one NPY flavour that the bridge sends: little-endian float32, C order. Format: https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html
 */
export interface NpyGrid {
  /** Rows. */
  readonly height: number;
  /** Columns. */
  readonly width: number;
  /** Row-major; not-a-number where the field is not known. */
  readonly values: Float32Array;
}

const MAGIC = '\x93NUMPY';

/** One grid: two dimensions. */
export function parseNpy(buffer: ArrayBuffer): NpyGrid {
  const { shape, values } = npyOf(buffer, 2);
  const [height = 0, width = 0] = shape;
  return { height, width, values };
}

/**
 * Numbers in so many dimensions.
 *
 * @throws Error where the body is anything else.
 */
export function npyOf(
  buffer: ArrayBuffer,
  dimensions: number,
): { readonly shape: readonly number[]; readonly values: Float32Array } {
  const bytes = new Uint8Array(buffer);
  const magic = String.fromCharCode(...bytes.subarray(0, MAGIC.length));
  if (magic !== MAGIC) throw new Error(`npy: magic is ${JSON.stringify(magic)}`);

  // Version 1 has a two-byte header length, versions 2 and 3 a four-byte one.
  const version = bytes[6] ?? 0;
  const view = new DataView(buffer);
  const lengthBytes = version === 1 ? 2 : 4;
  const start = 8 + lengthBytes;
  if (buffer.byteLength < start) throw new Error(`npy: only ${buffer.byteLength} bytes`);
  const length = version === 1 ? view.getUint16(8, true) : view.getUint32(8, true);
  const header = new TextDecoder('latin1').decode(bytes.subarray(start, start + length));

  const type = /'descr':\s*'([^']+)'/.exec(header)?.[1];
  if (type !== '<f4') throw new Error(`npy: type is ${String(type)}, expected <f4`);
  if (!/'fortran_order':\s*False/.test(header)) throw new Error('npy: not in C order');
  const shape = /'shape':\s*\(([\d,\s]+)\)/.exec(header)?.[1]?.match(/\d+/g)?.map(Number) ?? [];
  if (shape.length !== dimensions) {
    throw new Error(`npy: header is ${JSON.stringify(header)}, expected ${dimensions} dimensions`);
  }
  const body = buffer.slice(start + length);
  if (body.byteLength !== shape.reduce((size, each) => size * each, 4)) {
    throw new Error(`npy: ${body.byteLength} bytes of data, expected ${shape.join(' x ')} x 4`);
  }
  return { shape, values: new Float32Array(body) };
}
