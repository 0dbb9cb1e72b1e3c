/** The bridge's routes. Addresses are relative to the page, so any path prefix works. */
import { inSeconds } from './stamps';
import type { Field, FieldQuality, TagHistory } from './types';

export class Refusal extends Error {
  constructor(
    readonly status: number,
    message: string,
    /** How long the server wants to be left alone, seconds; null: not reported. */
    readonly retryAfterS: number | null = null,
  ) {
    super(message);
  }
}

export const route = (path: string): URL => new URL(path, document.baseURI);

export function stateSocketUrl(): string {
  const url = route('ws/state');
  url.protocol = url.protocol === 'https:' ? 'wss:' : 'ws:';
  url.hash = '';
  // Deltas after a full state, so that hundreds of tags hardly load the Wi-Fi.
  url.search = 'delta=1';
  return url.href;
}

/** Parameters of a query; undefined ones are left out. */
type Query = Readonly<Record<string, string | number | undefined>>;

export function withQuery(path: string, query: Query): string {
  const parts = new URLSearchParams();
  for (const [name, value] of Object.entries(query)) {
    if (value !== undefined) parts.set(name, String(value));
  }
  return `${path}?${parts.toString()}`;
}

/** A moment in the routes' format, never with an exponent; ROS seconds. */
export const momentParameter = (at: number): string => Math.max(0, at).toFixed(3);

/** An answer of the bridge. The browser always sends its ETag, and a 304 has no body. */
export const get = (path: string, signal: AbortSignal): Promise<Response> =>
  request(path, { signal, cache: 'no-cache' });

/**
 * An answer in JSON. The server's tests compare its answers with the schemas that its types here are from.
 * One without a part that the page `needs`, from another server, fails here and not where it is shown.
 */
export async function answer<T extends object>(
  signal: AbortSignal,
  path: string,
  needs: readonly (keyof T & string)[],
  query?: Query,
): Promise<T> {
  const body = await bodyOf<T>(await get(query ? withQuery(path, query) : path, signal));
  const lacking = needs.find((part) => body[part] === undefined);
  if (lacking !== undefined) throw new Error(`${path}: the answer has no "${lacking}"`);
  return body;
}

/** A refusal is thrown with its reason. */
export async function request(path: string, init: RequestInit): Promise<Response> {
  const response = await fetch(route(path), init);
  if (!response.ok) {
    const wait = Number(response.headers.get('Retry-After') ?? NaN);
    const reason = await reasonOf(response);
    throw new Refusal(response.status, reason, Number.isFinite(wait) ? wait : null);
  }
  return response;
}

export async function bodyOf<T>(response: Response): Promise<T> {
  const type = response.headers.get('Content-Type') ?? 'no type';
  const body: unknown = type.includes('json') ? inSeconds(await response.json()) : type;
  if (typeof body !== 'object' || body === null) {
    const { pathname } = new URL(response.url, document.baseURI);
    throw new Error(`${pathname}: answered with ${String(body)}`);
  }
  return body as T;
}

/** Both kinds of refusal in the contract carry their reason in one field. */
async function reasonOf(response: Response): Promise<string> {
  const body = (await response.json().catch(() => null)) as Record<string, unknown> | null;
  const text = body?.['error_message'] || body?.['detail'];
  return text && typeof text === 'string'
    ? text
    : `${response.status} ${response.statusText}`.trim();
}

export interface FieldQuery {
  readonly sensor: string;
  readonly resolution: number;
  /** ROS seconds; none: now. */
  readonly at?: number;
  /** In the map frame, metres; none: around all tags. */
  readonly box?: Readonly<Record<'minX' | 'minY' | 'maxX' | 'maxY', number>>;
}

/** The grid of a field or estimate, and its numbers by the suffix of their headers. */
async function fetchGrid(
  kind: 'Field' | 'Estimate',
  dimensions: number,
  { sensor, resolution, at, box }: FieldQuery,
  signal: AbortSignal,
) {
  const query = {
    ...{ sensor_type: sensor, resolution, at: at?.toFixed(3) },
    ...{ bbox_min_x: box?.minX, bbox_min_y: box?.minY },
    ...{ bbox_max_x: box?.maxX, bbox_max_y: box?.maxY },
  };
  const response = await get(withQuery(`api/${kind.toLowerCase()}.npy`, query), signal);
  const { shape, values } = npyOf(await response.arrayBuffer(), dimensions);
  const [height = 0, width = 0] = shape.slice(-2);
  const header = (end: string): number => {
    const name = `X-${kind}-${end}`;
    const value = Number(response.headers.get(name) ?? NaN);
    if (!Number.isFinite(value)) throw new Error(`field: header ${name} is missing or no number`);
    return value;
  };
  const grid = {
    ...{ width, height, originX: header('Origin-X'), originY: header('Origin-Y') },
    ...{ resolution: header('Resolution'), sampleCount: header('Sample-Count') },
  };
  return { grid, shape, values, header };
}

export async function fetchField(query: FieldQuery, signal: AbortSignal): Promise<Field> {
  const { grid, values, header } = await fetchGrid('Field', 2, query, signal);
  const [valueMin, valueMax] = [header('Value-Min'), header('Value-Max')];
  return { ...grid, sensor: query.sensor, valueMin, valueMax, values };
}

export type Estimate = Awaited<ReturnType<typeof fetchEstimate>>;

/** Each cell has a mean, whatever its error; not-a-number where the greenhouse is not explored. */
export async function fetchEstimate(query: FieldQuery, signal: AbortSignal) {
  const { grid, shape, values, header } = await fetchGrid('Estimate', 3, query, signal);
  if (shape[0] !== 2) throw new Error(`estimate: ${shape[0]} grids, expected mean and sd`);
  const cells = grid.width * grid.height;
  return {
    ...grid,
    mean: values.subarray(0, cells),
    sd: values.subarray(cells),
    sdKnown: header('Sd-Known'),
  };
}

/** `at`: ROS seconds; none: now. */
export const fetchQuality = (
  sensor: string,
  signal: AbortSignal,
  at?: number,
): Promise<FieldQuality> =>
  answer(signal, 'api/field/quality', ['rmse'], { sensor_type: sensor, at: at?.toFixed(3) });

export const fetchHistory = (tagId: string, signal: AbortSignal): Promise<TagHistory> =>
  answer(signal, `api/tags/${encodeURIComponent(tagId)}/history`, ['sensors', 'tries']);

/**
 * Numbers in the given dimensions, row-major, in the one NPY format that the bridge sends: version 1,
 * little-endian float32, C order. Format: https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html
 */
export function npyOf(
  buffer: ArrayBuffer,
  dimensions: number,
): { readonly shape: readonly number[]; readonly values: Float32Array } {
  // After the magic word and the version: the header's length, and the header.
  const start = 10;
  const length = buffer.byteLength < start ? 0 : new DataView(buffer).getUint16(8, true);
  const header = new TextDecoder('latin1').decode(buffer.slice(start, start + length));
  const shape = /'shape':\s*\(([\d,\s]+)\)/.exec(header)?.[1]?.match(/\d+/g)?.map(Number) ?? [];
  if (shape.length !== dimensions) {
    throw new Error(`npy: header is ${JSON.stringify(header)}, expected ${dimensions} dimensions`);
  }
  return { shape, values: new Float32Array(buffer.slice(start + length)) };
}
