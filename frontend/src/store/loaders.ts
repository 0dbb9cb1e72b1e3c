/** Fetches what frames do not carry, whenever the twin's revision changes. */
import { now, pause } from '../clock';
import { answer, fetchQuality, get } from '../contract/api';
import type { Field, FieldQuality, OccupancyGrid, SensorsFile } from '../contract/types';
import { type MapPicture, mapPlacement, opaqueBox, pixelBoxCorners } from '../geometry/image';
import { act, type AppState, keepFetched, onChange, receive, store } from './app';
import { PAGE } from './create';
import { withField, withLatest, withQuality } from './twin';
import { sourceOf } from './derived';
import { failed, NOTHING, ready, type FetchTask } from './fetcher';
import { boxOfPins, fetchHeat, fieldResolution } from './heat';
import { selectLatest, selectShown } from './moment';
import { DEFAULT_VIEW } from './view';

const FIELD_INTERVAL_MS = 500;
/** An estimate costs the twin more, and changes by itself: its error grows without readings. */
const ESTIMATE_INTERVAL_MS = 1_000;
const ESTIMATE_TICK_MS = 10_000;
const MAP_INTERVAL_MS = 1_000;
const QUALITY_INTERVAL_MS = 3_000;
/** The error of a past field is fetched once the moment has stayed this long. */
const QUALITY_AFTER_MS = 400;

export function startLoaders(signal = PAGE): void {
  forgetOld();
  onChange((state) => [state.twin], forgetOld, signal);
  keepFetched<Field>(
    {
      paceMs: FIELD_INTERVAL_MS,
      everyMs: ESTIMATE_TICK_MS,
      onValue: (value) => receive(withField(ready(value))),
      onError: (message) => {
        receive(withField(failed(message, selectLatest(store.get()).field.value)));
      },
    },
    fieldTask,
    signal,
  );
  keepFetched<MapPicture>(
    {
      paceMs: MAP_INTERVAL_MS,
      onValue: (value) => receive(withLatest({ map: ready(value) })),
      onError: (message) => {
        receive(withLatest({ map: failed(message, selectLatest(store.get()).map.value) }));
      },
    },
    (state) => {
      const base = baseKey(state);
      const hasMap = state.twin.connection.status?.has_map;
      return base !== null && hasMap ? { key: base, group: 'map', run: loadMap } : null;
    },
    signal,
  );
  startQuality(signal);
}

function fieldTask(state: AppState): FetchTask<Field> | null {
  const { sensor } = state.view;
  const { snapshot } = selectLatest(state);
  const base = baseKey(state);
  if (base === null || !boxOfPins(snapshot)) return null;
  const source = sourceOf(state);
  const isEstimate = source === 'estimate';
  const resolution = fieldResolution(snapshot);
  const tick = isEstimate ? Math.floor(now() / ESTIMATE_TICK_MS) : '';
  return {
    key: [base, sensor, resolution, source, tick].join('|'),
    group: `${sensor}|${source}`,
    paceMs: isEstimate ? ESTIMATE_INTERVAL_MS : FIELD_INTERVAL_MS,
    run: (signal) => fetchHeat(source, { sensor, resolution }, signal),
  };
}

export const startQuality = (signal = PAGE): void =>
  keepFetched<FieldQuality>(
    {
      paceMs: QUALITY_INTERVAL_MS,
      onValue: (quality) => receive(withQuality(quality)),
      onError: () => receive(withQuality(null)),
    },
    qualityTask,
    signal,
  );

/** The error of the shown field of nearest readings; an estimate has its own. */
function qualityTask(state: AppState): FetchTask<FieldQuality> | null {
  const { sensor, moment } = state.view;
  const base = baseKey(state);
  if (moment === null) {
    if (base === null || sourceOf(state) === 'estimate') return null;
    return { key: `${base}|${sensor}`, group: sensor, run: (on) => fetchQuality(sensor, on) };
  }
  const { moment: at, field, quality } = selectShown(state);
  if (at !== moment || field.value?.sensor !== sensor || field.value.sureness || quality)
    return null;
  const key = `${at}|${sensor}`;
  return {
    key,
    group: key,
    run: async (signal) => {
      await pause(QUALITY_AFTER_MS);
      signal.throwIfAborted();
      return fetchQuality(sensor, signal, at);
    },
  };
}

/** Clears at once what no longer applies: a restarted twin begins empty. */
function forgetOld(): void {
  const state = store.get();
  const { field, map, snapshot } = selectLatest(state);
  if (baseKey(state) === null) return;
  if (field.value && !boxOfPins(snapshot)) receive(withField(NOTHING));
  if (map.value && !state.twin.lastStatus?.has_map) receive(withLatest({ map: NOTHING }));
}

/**
 * Changes with the revision and with each connection, which may lead to another server. Null without
 * a connection, and until its first status and state.
 */
function baseKey(state: AppState): string | null {
  const { snapshot } = selectLatest(state);
  const { epoch, socket, status } = state.twin.connection;
  return snapshot && status && socket.kind === 'open' ? `${epoch}|${snapshot.revision}` : null;
}

const SENSORS_INTERVAL_MS = 500;

/** Fetches the file of sensors at the start and on each new connection, as the server may be another. */
export function startSensors(signal = PAGE): void {
  let known = '';
  keepFetched<SensorsFile>(
    {
      paceMs: SENSORS_INTERVAL_MS,
      onValue: (file) => {
        const text = JSON.stringify(file);
        // Mostly the bridge answers 304 and the file is unchanged.
        if (text === known) return;
        known = text;
        receive({ sensors: ready(file) });
        // If the file lacks the default sensor, its first one is shown.
        const [first] = Object.keys(file.sensors);
        const { sensor } = store.get().view;
        const isChosen = sensor !== DEFAULT_VIEW.sensor || sensor in file.sensors;
        if (first !== undefined && !isChosen) act({ sensor: first });
      },
      onError: (message) => {
        // The previous file stays in force: an unreachable bridge has no other ranges.
        if (known === '') receive({ sensors: failed(message) });
      },
    },
    ({ twin: { connection } }) => ({
      // The first connection opens during this fetch, and to the same bridge.
      key: String(Math.max(1, connection.epoch)),
      group: 'sensors',
      run: (on) => answer(on, 'api/sensors', ['ramp', 'fallback', 'sensors']),
    }),
    signal,
  );
}

/**
 * Fetches the map's pose and its picture. The map may grow between the two requests; a picture of
 * another size is an error, and the caller retries.
 */
async function loadMap(signal: AbortSignal): Promise<MapPicture> {
  const [grid, blob] = await Promise.all([
    answer<OccupancyGrid>(signal, 'api/map', ['info']),
    get('api/map.png', signal).then((response) => response.blob()),
  ]);
  const bitmap = await createImageBitmap(blob);
  const { width, height } = bitmap;
  const placement = mapPlacement(grid);
  if (width !== placement.width || height !== placement.height) {
    throw new Error(
      `map: the picture is ${width} x ${height}, announced were ` +
        `${placement.width} x ${placement.height}`,
    );
  }
  const canvas = document.createElement('canvas');
  canvas.width = width;
  canvas.height = height;
  const context = canvas.getContext('2d', { willReadFrequently: true });
  if (!context) throw new Error('map: this browser has no 2d canvas');
  context.drawImage(bitmap, 0, 0);
  bitmap.close();
  const pixels = context.getImageData(0, 0, width, height);
  const box = opaqueBox(pixels.data, width, height);
  return { placement, pixels, known: box ? pixelBoxCorners(placement, box) : [] };
}
