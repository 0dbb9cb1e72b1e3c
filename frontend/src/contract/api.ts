/** The bridge's routes. Addresses are relative to the page, so any path prefix works. */
import { checkOf } from './check';
import { parseNpy } from './npy';
import type { components } from './openapi.gen';
import type { Field, FieldQuality, OccupancyGrid, SensorsFile, TagHistory } from './types';

type Schemas = components['schemas'];

/** A refusal by the server, with its reason. */
export class Refusal extends Error {
  readonly status: number;
  /** How long the server wants to be left alone, seconds; null: not reported. */
  readonly retryAfterS: number | null;

  constructor(status: number, message: string, retryAfterS: number | null = null) {
    super(message);
    this.name = 'Refusal';
    this.status = status;
    this.retryAfterS = retryAfterS;
  }
}

export const route = (path: string): URL => new URL(path, document.baseURI);

export function stateSocketUrl(): string {
  const url = route('ws/state');
  url.protocol = url.protocol === 'https:' ? 'wss:' : 'ws:';
  url.hash = '';
  // Only what changed, after a full state: a house of hundreds costs the Wi-Fi next to nothing.
  url.search = 'delta=1';
  return url.href;
}

/** An answer of the bridge; a refusal is thrown with its reason. */
export async function get(
  path: string,
  signal: AbortSignal,
  headers?: HeadersInit,
): Promise<Response> {
  // "no-cache": the browser asks with its ETag each time, and a 304 costs no body.
  return ask(path, { signal, cache: 'no-cache', ...(headers ? { headers } : {}) });
}

export async function ask(path: string, init: RequestInit): Promise<Response> {
  const response = await fetch(route(path), init);
  if (!response.ok) {
    const wait = Number(response.headers.get('Retry-After') ?? NaN);
    const reason = await reasonOf(response);
    throw new Refusal(response.status, reason, Number.isFinite(wait) ? wait : null);
  }
  return response;
}

/** The body, an object of JSON; what a proxy in between answers is none. */
export async function bodyOf<T>(response: Response): Promise<T> {
  const type = response.headers.get('Content-Type') ?? 'no type';
  const body: unknown = type.includes('json') ? await response.json() : type;
  if (typeof body !== 'object' || body === null) {
    const { pathname } = new URL(response.url, document.baseURI);
    throw new Error(`${pathname}: answered with ${String(body)}`);
  }
  return body as T;
}

/** The body, checked against the server's schema of that name. */
export async function read<Name extends keyof Schemas>(
  name: Name,
  response: Response,
): Promise<Schemas[Name]> {
  const body = await bodyOf<Schemas[Name]>(response);
  const fault = checkOf(name)(body);
  if (fault !== null) throw new Error(name + fault);
  return body;
}

/** Both kinds of refusal in the contract carry their reason in one field. */
async function reasonOf(response: Response): Promise<string> {
  const body: unknown = await response.json().catch(() => null);
  if (typeof body === 'object' && body !== null) {
    for (const key of ['error_message', 'detail'] as const) {
      const text = (body as Record<string, unknown>)[key];
      if (typeof text === 'string' && text !== '') return text;
    }
  }
  return `${response.status} ${response.statusText}`.trim();
}

const BOX_NAMES = {
  minX: 'bbox_min_x',
  minY: 'bbox_min_y',
  maxX: 'bbox_max_x',
  maxY: 'bbox_max_y',
} as const;

/** A box in the map frame, metres. */
type Box = Readonly<Record<keyof typeof BOX_NAMES, number>>;

export interface FieldQuery {
  readonly sensor: string;
  readonly resolution: number;
  /** ROS seconds; none: now. */
  readonly at?: number;
  /** Metres; none: around all tags. */
  readonly box?: Box;
}

export function fieldParameters(query: FieldQuery): string {
  const parts = new URLSearchParams({
    sensor_type: query.sensor,
    resolution: String(query.resolution),
  });
  if (query.at !== undefined) parts.set('at', query.at.toFixed(3));
  if (query.box) {
    for (const [edge, name] of Object.entries(BOX_NAMES) as [keyof Box, string][]) {
      parts.set(name, String(query.box[edge]));
    }
  }
  return parts.toString();
}

/** Reads numbers out of an answer's headers. */
export const numberIn =
  ({ headers }: Response) =>
  (name: string): number => {
    const value = Number(headers.get(name) ?? NaN);
    if (!Number.isFinite(value)) throw new Error(`field: header ${name} is missing or no number`);
    return value;
  };

export async function fetchField(query: FieldQuery, signal: AbortSignal): Promise<Field> {
  const response = await get(`api/field.npy?${fieldParameters(query)}`, signal);
  const grid = parseNpy(await response.arrayBuffer());
  const header = numberIn(response);
  return {
    sensor: query.sensor,
    width: grid.width,
    height: grid.height,
    originX: header('X-Field-Origin-X'),
    originY: header('X-Field-Origin-Y'),
    resolution: header('X-Field-Resolution'),
    valueMin: header('X-Field-Value-Min'),
    valueMax: header('X-Field-Value-Max'),
    sampleCount: header('X-Field-Sample-Count'),
    values: grid.values,
  };
}

/** `at`: ROS seconds; none: now. */
export async function fetchQuality(
  sensor: string,
  signal: AbortSignal,
  at?: number,
): Promise<FieldQuality> {
  const parts = new URLSearchParams({ sensor_type: sensor });
  if (at !== undefined) parts.set('at', at.toFixed(3));
  const response = await get(`api/field/quality?${parts.toString()}`, signal);
  return read('FieldQuality', response);
}

export async function fetchMap(signal: AbortSignal): Promise<OccupancyGrid> {
  const response = await get('api/map', signal);
  return read('OccupancyGrid', response);
}

export async function fetchMapPicture(signal: AbortSignal): Promise<Blob> {
  const response = await get('api/map.png', signal);
  return response.blob();
}

/** The file of sensors that is in force. */
export async function fetchSensors(signal: AbortSignal): Promise<SensorsFile> {
  const response = await get('api/sensors', signal);
  return bodyOf(response);
}

export async function fetchHistory(tagId: string, signal: AbortSignal): Promise<TagHistory> {
  const response = await get(`api/tags/${encodeURIComponent(tagId)}/history`, signal);
  return read('TagHistory', response);
}
