/** Fetches what the frames do not carry, whenever the twin's revision says that it changed. */
import { fetchField, fetchQuality, Refusal } from '../contract/api';
import type { FieldQuality } from '../contract/types';
import { resolutionFor, type Field } from '../domain/field';
import type { Snapshot } from '../domain/twin';
import { boundsOf } from '../geometry/coordinates';
import { loadMap, type MapPicture } from '../map/picture';
import { receive, store, type AppState } from './app';
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
      const { value } = store.get().twin.field;
      receive({ type: 'field', field: { value, state: 'failed', message: reason(error) } });
    },
  });
  const map = createRefresher<MapPicture>({
    intervalMs: MAP_INTERVAL_MS,
    onValue: (value) => {
      receive({ type: 'map', map: { value, state: 'ready', message: '' } });
    },
    onError: (error) => {
      const { value } = store.get().twin.map;
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
    const base = baseKey(state);
    if (base === null) return;
    const { sensor } = state.view;
    if (state.twin.field.value && state.twin.field.value.sensor !== sensor) {
      receive({ type: 'field', field: NOTHING });
      receive({ type: 'quality', quality: null });
    }
    field.want(fieldTask(base, sensor, state.twin.snapshot));
    map.want({ key: base, group: 'map', run: loadMap });
    const { epoch } = state.twin.connection;
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

/** Changes with the revision, and with each connection: another server may sit behind it. */
function baseKey({ twin }: AppState): string | null {
  return twin.snapshot && twin.connection.epoch > 0
    ? `${twin.connection.epoch}|${twin.snapshot.revision}`
    : null;
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
