/**
 * Fetches what a compared heat map needs: the fields of the shown and of the other moment, on one
 * grid.
 */
import { now } from '../clock';
import { COMPARED, differenceOf, type Compare } from '../domain/difference';
import type { Snapshot } from '../domain/twin';
import type { Bounds } from '../geometry/coordinates';
import { keepFetched, receive, type AppState } from './app';
import { PAGE } from './create';
import { sourceOf } from './derived';
import { boxOfPins, fetchHeat, fieldResolution } from './heat';
import {
  isBeforeAll,
  isReceivingNow,
  rosNow,
  selectDayS,
  selectLatest,
  selectShown,
} from './moment';
import { DRAG_PACE_MS, failed, NOTHING, ready, type FetchTask } from './fetcher';
import { type Difference } from './twin';

/** When live, the other moment follows now in steps of this length, seconds. */
const STEP_S = 10;
const TICK_MS = 2_000;

export function startDifference(signal = PAGE): void {
  let before: AppState | null = null;
  keepFetched<Difference>(
    {
      paceMs: DRAG_PACE_MS,
      everyMs: TICK_MS,
      isDragged: true,
      onValue: (value) => receive({ difference: ready(value) }),
      onError: (message) => receive({ difference: failed(message) }),
    },
    (state) => {
      const { compare, sensor } = state.view;
      // A difference of another sensor, source or comparison must not stay, nor one of the past after it.
      const isOther =
        compare === null ||
        before?.view.compare !== compare ||
        before.view.sensor !== sensor ||
        sourceOf(before) !== sourceOf(state) ||
        isPast(before) !== isPast(state);
      before = state;
      if (isOther && state.twin.difference !== NOTHING) receive({ difference: NOTHING });
      return compare && taskFor(state, compare);
    },
    signal,
  );
}

const isPast = (state: AppState): boolean => selectShown(state).moment !== null;

function taskFor(state: AppState, compare: Compare): FetchTask<Difference> | undefined {
  const { moment, snapshot } = selectShown(state);
  const { epoch, socket } = state.twin.connection;
  // The last state of a silent twin is shown, and keeps its own time.
  const nowS = rosNow(state, isReceivingNow(state) ? now() : -Infinity);
  const resolution = fieldResolution(selectLatest(state).snapshot);
  const box = boxOf(snapshot, resolution);
  if (!snapshot || nowS === null || socket.kind !== 'open') return undefined;
  const { sensor } = state.view;
  const source = sourceOf(state);
  const at = moment ?? Math.floor(nowS / STEP_S) * STEP_S;
  const against = at - COMPARED[compare] * selectDayS(state);
  const what = [epoch, sensor, source, moment ?? snapshot.revision, against, box];
  return {
    key: JSON.stringify(what),
    run: async (signal) => {
      if (!box) return { field: null, at, against: at };
      const query = { sensor, resolution, box };
      const [shown, then] = await Promise.all([
        fetchHeat(source, moment === null ? query : { ...query, at: moment }, signal),
        isBeforeAll(state, against) ? null : fetchHeat(source, { ...query, at: against }, signal),
      ]);
      return { field: differenceOf(shown, then), at, against };
    },
  };
}

/** A box around all pins, in whole cells, so that both fields share them. */
function boxOf(snapshot: Snapshot | null, resolution: number): Bounds | null {
  const bounds = boxOfPins(snapshot);
  if (!bounds) return null;
  const down = (metres: number): number => round(Math.floor(metres / resolution) * resolution);
  const up = (metres: number): number => round(Math.ceil(metres / resolution) * resolution);
  const { minX, minY, maxX, maxY } = bounds;
  return { minX: down(minX), minY: down(minY), maxX: up(maxX), maxY: up(maxY) };
}

const round = (metres: number): number => Math.round(metres * 1e6) / 1e6;
