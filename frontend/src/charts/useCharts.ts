import { useMemo, useRef, useState } from 'react';

import { now, pause } from '../clock';
import { type Catalogue, isHad, isMeasured } from '../domain/sensors';
import { endsNow, spanOf } from '../domain/time';
import { type AppState, store, useApp, useContent } from '../store/app';
import { createStore, useSelected } from '../store/create';
import { selectCatalogue, selectCatalogues } from '../store/derived';
import { useFetched } from '../store/fetcher';
import { rosNow, selectDayS, selectLatestTag, selectTag } from '../store/moment';
import { turnOf } from '../store/remembered';
import { DEFAULT_VIEW } from '../store/view';
import { useNow } from '../widgets/useNow';
import { fetchLines, type Lines, modelOf } from './model';

/** Interval between requests for the same lines, ms; longer for many lines. */
const PACE_MS = 3_000;
const PACE_A_LINE_MS = 1_000;
/** Received data are in the journal within 100 ms, and in another host's copy soon after. */
const WRITTEN_MS = 1_000;

export type Charts = ReturnType<typeof useCharts>;

/**
 * A chart for each sensor, with a line for each tag, over the time bar's period: refetched after a visit
 * to one of the tags, on each connection, and at intervals.
 */
export function useCharts(
  sensors: readonly string[],
  tagIds: readonly string[],
  points: number,
  hasDayBefore = false,
) {
  const moment = useApp((state) => state.view.moment);
  const catalogue = useApp(selectCatalogue);
  const both = useApp(selectCatalogues);
  const species = useContent((state) =>
    tagIds.map((id) => selectTag(state, id)?.sureSpecies ?? ''),
  );
  const period = useApp((state) => state.view.period);
  const { value: known, state: reaching } = useApp((state) => state.twin.remembered);
  const epoch = useApp((state) => state.twin.connection.epoch);
  const isOpen = useApp((state) => state.twin.connection.socket.kind === 'open');
  const dayS = useApp((state) => (hasDayBefore ? selectDayS(state) : null));
  /** The time of the twin, ROS seconds. */
  const nowS = rosNow(store.get(), useNow());
  const visits = useVisits(tagIds);
  const answered = useRef('');
  const oldest = known?.reach?.from ?? null;
  // How far the past reaches decides where a period begins, and which one the page opens on.
  const isEarly =
    (period.kind === 'all' || period === DEFAULT_VIEW.period) &&
    known === null &&
    reaching === 'waiting';
  /** Null while the time is not known. */
  const span = nowS === null ? null : spanOf(period, nowS, oldest);
  const group = JSON.stringify([period, points, dayS, sensors, tagIds]);
  // During a refetch, the old lines stay.
  const { value, state, message } = useFetched<Lines>(
    nowS === null || !isOpen || points === 0 || isEarly
      ? null
      : {
          key: [group, epoch, oldest, turnOf(period, nowS), visits].join('\u0001'),
          group,
          paceMs: Math.max(PACE_MS, PACE_A_LINE_MS * sensors.length * tagIds.length),
          run: async (signal) => {
            if (answered.current === group) await pause(WRITTEN_MS);
            // The twin's time has advanced since the task was made.
            const atS = rosNow(store.get(), now()) ?? nowS;
            const then = { span: spanOf(period, atS, oldest), nowS: atS };
            const lines = await fetchLines({ sensors, tagIds, points, dayS, ...then }, signal);
            answered.current = group;
            return lines;
          },
        },
    PACE_MS,
  );
  const models = span
    ? sensors.map((sensor) =>
        modelOf(catalogue, both, sensor, tagIds, species, value ?? [], span, moment, nowS),
      )
    : [];
  return { models, span, state, message };
}

/** Changes when one of the tags is visited; not in the past, nor for a period that has ended. */
function useVisits(tagIds: readonly string[]): string {
  const newest = useApp((state) =>
    state.view.moment === null && endsNow(state.view.period) ? visitsOf(state, tagIds) : null,
  );
  const [visits, setVisits] = useState('');
  if (newest !== null && newest !== visits) setVisits(newest);
  return visits;
}

const visitsOf = (state: AppState, tagIds: readonly string[]): string =>
  JSON.stringify(
    tagIds.map((tagId) => {
      const wire = selectLatestTag(state, tagId)?.wire;
      return [wire?.last_observed, wire?.last_try];
    }),
  );

/** The sensor chosen for the card's chart, and the map's at that time: if the map changes, the card follows. */
export const chosenSensor = createStore<{ name: string; inView: string } | null>(null);

/** The sensor of the card's chart: the one in view, unless another was chosen. */
export function useChosenSensor(): string {
  const inView = useApp((state) => state.view.sensor);
  const chosen = useSelected(chosenSensor);
  return chosen?.inView === inView ? chosen.name : inView;
}

/**
 * The tag's sensors at the shown moment, in their usual order; and the one in view or chosen, if it
 * is computed from them.
 */
export function useSensorsOf(tagId: string): readonly string[] {
  const chosen = useChosenSensor();
  const names = useContent((state): readonly string[] => {
    const readings = selectTag(state, tagId)?.readings;
    if (!readings) return [];
    const computed = [state.view.sensor, chosen].filter((name) => {
      const sensor = selectCatalogue(state).named(name);
      return !isMeasured(sensor) && isHad(sensor, (each) => readings.has(each));
    });
    return [...new Set([...readings.keys(), ...computed])];
  });
  const catalogue = useApp(selectCatalogue);
  return useMemo(() => inOrder(catalogue, names), [catalogue, names]);
}

function inOrder({ all }: Catalogue, names: readonly string[]): readonly string[] {
  const declared = all.map(({ name }) => name).filter((name) => names.includes(name));
  return [...declared, ...names.filter((name) => !declared.includes(name)).sort()];
}

/** Narrower buckets would be indistinguishable. */
const BUCKET_PX = 2;
const STEP = 50;
const MOST = 1_000;

/**
 * The number of distinguishable points or buckets in a chart of that width, in steps, so that resizing
 * a window does not refetch at each pixel. 0 while there is no width.
 */
export const pointsFor = (width: number): number =>
  width === 0 ? 0 : Math.min(MOST, Math.max(100, Math.ceil(width / BUCKET_PX / STEP) * STEP));
