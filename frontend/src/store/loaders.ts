/** Fetches what the frames do not carry, whenever the twin's revision says that it changed. */
import { fetchQuality, Refusal } from '../contract/api';
import type { Field, FieldQuality } from '../contract/types';
import type { Snapshot } from '../domain/twin';
import type { MapPicture } from '../geometry/image';
import { loadMap } from './picture';
import { onChange, receive, store, type AppState } from './app';
import { sourceOf, type Source } from './derived';
import { boundsOfPins, fetchHeat, fieldResolution } from './heat';
import { selectNewest } from './moment';
import { createFetcher, NOTHING, type Wish } from './fetcher';

const FIELD_INTERVAL_MS = 500;
/** An estimate costs the twin more, and goes on by itself: what nobody reads becomes less sure. */
const ESTIMATE_INTERVAL_MS = 1_000;
const ESTIMATE_TICK_MS = 10_000;
const MAP_INTERVAL_MS = 1_000;
const QUALITY_INTERVAL_MS = 3_000;

export function startLoaders(): () => void {
  const field = createFetcher<Field>({
    paceMs: FIELD_INTERVAL_MS,
    onValue: (value) => {
      receive({ type: 'field', field: { value, state: 'ready', message: '' } });
    },
    onError: (message) => {
      const { value } = selectNewest(store.get()).field;
      receive({ type: 'field', field: { value, state: 'failed', message } });
    },
  });
  const map = createFetcher<MapPicture>({
    paceMs: MAP_INTERVAL_MS,
    onValue: (value) => {
      receive({ type: 'map', map: { value, state: 'ready', message: '' } });
    },
    onError: (message) => {
      const { value } = selectNewest(store.get()).map;
      receive({ type: 'map', map: { value, state: 'failed', message } });
    },
  });
  const quality = createFetcher<FieldQuality | null>({
    paceMs: QUALITY_INTERVAL_MS,
    onValue: (value) => {
      receive({ type: 'quality', quality: value });
    },
    onError: () => {
      receive({ type: 'quality', quality: null });
    },
  });

  let missingSince = -1;
  let ticking: ReturnType<typeof setInterval> | undefined;
  let ticks = 0;

  const update = (): void => {
    const state = store.get();
    const source = sourceOf(state);
    if (source === 'estimate') {
      ticking ??= setInterval(() => {
        ticks += 1;
        update();
      }, ESTIMATE_TICK_MS);
    } else {
      clearInterval(ticking);
      ticking = undefined;
    }
    const { epoch, status } = state.twin.connection;
    const newest = selectNewest(state);
    const { sensor } = state.view;
    const base = baseKey(state);
    const wanted = base === null ? null : fieldTask(base, sensor, source, ticks, newest.snapshot);
    // What the page does not show any more goes at once: a restarted twin begins empty.
    const { value } = newest.field;
    if (value && (value.sensor !== sensor || (base !== null && !wanted))) {
      receive({ type: 'field', field: NOTHING });
      receive({ type: 'quality', quality: null });
    }
    field.want(wanted);
    if (base === null) {
      map.want(null);
      quality.want(null);
      return;
    }
    if (newest.map.value && !status?.has_map) receive({ type: 'map', map: NOTHING });
    map.want(status?.has_map ? { key: base, group: 'map', run: loadMap } : null);
    quality.want(
      // Of the nearest readings: an estimate tells its own error.
      epoch === missingSince || source === 'estimate'
        ? null
        : {
            key: `${base}|${sensor}`,
            group: sensor,
            run: (signal) =>
              fetchQuality(sensor, signal).catch((error: unknown) => {
                // A server without this route: the page does without, until the next server.
                if (!(error instanceof Refusal) || error.status !== 404) throw error;
                missingSince = epoch;
                return null;
              }),
          },
    );
  };
  update();
  const stop = onChange((state) => [state.twin, state.view.sensor, sourceOf(state)], update);
  return () => {
    stop();
    clearInterval(ticking);
  };
}

/**
 * Changes with the revision, and with each connection: another server may sit behind it. Null
 * while there is none, and until the bridge has said on it what there is to ask for.
 */
function baseKey(state: AppState): string | null {
  const { snapshot } = selectNewest(state);
  const { epoch, socket, status } = state.twin.connection;
  return snapshot && status && socket.kind === 'open' ? `${epoch}|${snapshot.revision}` : null;
}

function fieldTask(
  base: string,
  sensor: string,
  source: Source,
  ticks: number,
  snapshot: Snapshot | null,
): Wish<Field> | null {
  if (!boundsOfPins(snapshot)) return null;
  const resolution = fieldResolution(snapshot);
  const isEstimate = source === 'estimate';
  return {
    key: [base, sensor, resolution, source, isEstimate ? ticks : ''].join('|'),
    group: `${sensor}|${source}`,
    ...(isEstimate ? { paceMs: ESTIMATE_INTERVAL_MS } : {}),
    run: (signal) => fetchHeat(source, { sensor, resolution }, signal),
  };
}
