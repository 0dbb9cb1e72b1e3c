/** Fetches what the frames do not carry, whenever the twin's revision says that it changed. */
import { now } from '../clock';
import { answer, bodyOf, fetchQuality, get } from '../contract/api';
import type { Field, FieldQuality, SensorsFile } from '../contract/types';
import { cataloguesOf } from '../domain/sensors';
import { type MapPicture, mapPlacement, opaqueBox, pixelBoxCorners } from '../geometry/image';
import { act, type AppState, keepFetched, onChange, receive, store } from './app';
import { withField, withLatest } from './twin';
import { sourceOf } from './derived';
import { failed, NOTHING, ready, type FetchTask } from './fetcher';
import { boxOfPins, fetchHeat, fieldResolution } from './heat';
import { selectLatest } from './moment';
import { DEFAULT_VIEW } from './view';

const FIELD_INTERVAL_MS = 500;
/** An estimate costs the twin more, and goes on by itself: what nobody reads becomes less sure. */
const ESTIMATE_INTERVAL_MS = 1_000;
const ESTIMATE_TICK_MS = 10_000;
const MAP_INTERVAL_MS = 1_000;
const QUALITY_INTERVAL_MS = 3_000;

export function startLoaders(): () => void {
  forgetOld();
  const stops = [
    onChange((state) => [state.twin], forgetOld),
    keepFetched<Field>(
      {
        paceMs: FIELD_INTERVAL_MS,
        everyMs: ESTIMATE_TICK_MS,
        onValue: (value) => {
          receive(withField(ready(value)));
        },
        onError: (message) => {
          receive(withField(failed(message, selectLatest(store.get()).field.value)));
        },
      },
      fieldTask,
    ),
    keepFetched<MapPicture>(
      {
        paceMs: MAP_INTERVAL_MS,
        onValue: (value) => {
          receive(withLatest({ map: ready(value) }));
        },
        onError: (message) => {
          receive(withLatest({ map: failed(message, selectLatest(store.get()).map.value) }));
        },
      },
      (state) => {
        const base = baseKey(state);
        const hasMap = state.twin.connection.status?.has_map;
        return base !== null && hasMap ? { key: base, group: 'map', run: loadMap } : null;
      },
    ),
    keepFetched<FieldQuality>(
      {
        paceMs: QUALITY_INTERVAL_MS,
        onValue: (quality) => {
          receive(withLatest({ quality }));
        },
        onError: () => {
          receive(withLatest({ quality: null }));
        },
      },
      (state) => {
        const base = baseKey(state);
        const { sensor } = state.view;
        // Of the nearest readings: an estimate tells its own error.
        if (base === null || sourceOf(state) === 'estimate') return null;
        const run = (signal: AbortSignal): Promise<FieldQuality> => fetchQuality(sensor, signal);
        return { key: `${base}|${sensor}`, group: sensor, run };
      },
    ),
  ];
  return () => {
    for (const stop of stops) stop();
  };
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

/** What the page does not show any more goes at once: a restarted twin begins empty. */
function forgetOld(): void {
  const state = store.get();
  const { field, map, snapshot } = selectLatest(state);
  if (baseKey(state) === null) return;
  if (field.value && !boxOfPins(snapshot)) receive(withField(NOTHING));
  if (map.value && !state.twin.lastStatus?.has_map) receive(withLatest({ map: NOTHING }));
}

/**
 * Changes with the revision, and with each connection: another server may sit behind it. Null
 * while there is none, and until the bridge has said on it what there is to ask for.
 */
function baseKey(state: AppState): string | null {
  const { snapshot } = selectLatest(state);
  const { epoch, socket, status } = state.twin.connection;
  return snapshot && status && socket.kind === 'open' ? `${epoch}|${snapshot.revision}` : null;
}

const SENSORS_INTERVAL_MS = 500;

const fetchFile = async (signal: AbortSignal): Promise<SensorsFile> =>
  bodyOf(await get('api/sensors', signal));

/** Fetches the file of sensors: at once, and again on each new connection, behind which may be another. */
export function startSensors(): () => void {
  let known = '';
  return keepFetched<SensorsFile>(
    {
      paceMs: SENSORS_INTERVAL_MS,
      onValue: (file) => {
        const text = JSON.stringify(file);
        // The browser asks with its ETag, and mostly is told that it has it: nothing follows then.
        if (text === known) return;
        known = text;
        const value = cataloguesOf(file);
        receive({ sensors: ready(value) });
        // A file without what the page opens with: then the first that it has.
        const [first] = value.day.all;
        const { sensor } = store.get().view;
        const isChosen = sensor !== DEFAULT_VIEW.sensor || sensor in file.sensors;
        if (first && !isChosen) act({ sensor: first.name });
      },
      onError: (message) => {
        // What was in force before goes on: a bridge that is away has no other ranges.
        if (known === '') receive({ sensors: failed(message) });
      },
    },
    ({ twin: { connection } }) => ({
      // The first connection is made while this is fetched, and to the same bridge.
      key: String(Math.max(1, connection.epoch)),
      group: 'sensors',
      run: fetchFile,
    }),
  );
}

/**
 * Fetches the map's place and its picture. The map may grow between the two requests; a picture
 * of another size than announced is an error, and the caller tries again.
 */
async function loadMap(signal: AbortSignal): Promise<MapPicture> {
  const [grid, blob] = await Promise.all([
    answer('OccupancyGrid', signal, 'api/map'),
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
