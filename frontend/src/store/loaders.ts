/** Fetches what the frames do not carry, whenever the twin's revision says that it changed. */
import { fetchField, fetchQuality, Refusal } from '../contract/api';
import type { Field, FieldQuality } from '../contract/types';
import { resolutionFor } from '../domain/field';
import type { Snapshot } from '../domain/twin';
import { boundsOf } from '../geometry/coordinates';
import { loadMap, type MapPicture } from './picture';
import { receive, store, type AppState } from './app';
import { selectNewest } from './moment';
import { createRefresher, type Task } from './refresher';
import { NOTHING } from './twin';

const FIELD_INTERVAL_MS = 500;
const MAP_INTERVAL_MS = 1_000;
const QUALITY_INTERVAL_MS = 3_000;
/** The server's box is that of the pinned tags widened by its max_distance_m. */
const ASSUMED_MARGIN_M = 1.5;
/** Finer cells than this cannot be told apart on a screen, and cost the Wi-Fi. */
const MAX_CELLS = 60_000;

export function startLoaders(): () => void {
  const field = createRefresher<Field>({
    intervalMs: FIELD_INTERVAL_MS,
    onValue: (value) => {
      receive({ type: 'field', field: { value, state: 'ready', message: '' } });
    },
    onError: (error) => {
      const { value } = selectNewest(store.get()).field;
      receive({ type: 'field', field: { value, state: 'failed', message: reason(error) } });
    },
  });
  const map = createRefresher<MapPicture>({
    intervalMs: MAP_INTERVAL_MS,
    onValue: (value) => {
      receive({ type: 'map', map: { value, state: 'ready', message: '' } });
    },
    onError: (error) => {
      const { value } = selectNewest(store.get()).map;
      receive({ type: 'map', map: { value, state: 'failed', message: reason(error) } });
    },
  });
  const quality = createRefresher<FieldQuality | null>({
    intervalMs: QUALITY_INTERVAL_MS,
    onValue: (value) => {
      receive({ type: 'quality', quality: value });
    },
    onError: () => {
      receive({ type: 'quality', quality: null });
    },
  });

  let missingSince = -1;
  let seen: AppState | null = null;

  const update = (): void => {
    const state = store.get();
    if (seen?.twin === state.twin && seen.view.sensor === state.view.sensor) return;
    seen = state;
    const { epoch, status } = state.twin.connection;
    const newest = selectNewest(state);
    const { sensor } = state.view;
    const base = baseKey(state);
    const wanted = base === null ? null : fieldTask(base, sensor, newest.snapshot);
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
      epoch === missingSince
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
  return store.subscribe(update);
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

function fieldTask(base: string, sensor: string, snapshot: Snapshot | null): Task<Field> | null {
  const bounds = boundsOf((snapshot?.tags ?? []).flatMap((tag) => (tag.at ? [tag.at] : [])));
  if (!bounds) return null;
  const resolution = resolutionFor(
    {
      minX: bounds.minX - ASSUMED_MARGIN_M,
      minY: bounds.minY - ASSUMED_MARGIN_M,
      maxX: bounds.maxX + ASSUMED_MARGIN_M,
      maxY: bounds.maxY + ASSUMED_MARGIN_M,
    },
    MAX_CELLS,
  );
  return {
    key: `${base}|${sensor}|${resolution}`,
    group: sensor,
    run: (signal) => fetchField({ sensor, resolution }, signal),
  };
}

function reason(error: unknown): string {
  return error instanceof Error ? error.message : String(error);
}
