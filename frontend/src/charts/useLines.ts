import { useMemo, useRef, useState } from 'react';

import { now, pause } from '../clock';
import { type Catalogue, isHad, isMeasured } from '../domain/sensors';
import { endsNow, spanOf } from '../domain/time';
import { type AppState, store, useApp } from '../store/app';
import { createStore, useSelected } from '../store/create';
import { selectCatalogue, selectCatalogues } from '../store/derived';
import { useFetched } from '../store/fetcher';
import { rosNow, selectDayS, selectLatestTag, selectTag } from '../store/moment';
import { turnOf } from '../store/remembered';
import { useNow } from '../widgets/useNow';
import { fetchLines, type Lines, modelOf, NO_LINES, type Pair, pairKey, type Plan } from './model';

/** Between two questions about the same lines, ms; of many lines longer. */
const PACE_MS = 3_000;
const PACE_A_LINE_MS = 1_000;
/** What was heard is in the journal within 100 ms, and in another host's copy of it soon after. */
const WRITTEN_MS = 1_000;

export type RequestedLines = ReturnType<typeof useLines>;

/**
 * What these lines have over the period of the time bar: asked for again when one of the tags was
 * visited, on each connection, and now and then.
 */
export function useLines(pairs: readonly Pair[], points: number, hasDayBefore = false) {
  const period = useApp((state) => state.view.period);
  const reach = useApp((state) => state.twin.remembered.value?.reach);
  const epoch = useApp((state) => state.twin.connection.epoch);
  const isOpen = useApp((state) => state.twin.connection.socket.kind === 'open');
  const dayS = useApp((state) => (hasDayBefore ? selectDayS(state) : null));
  const nowS = rosNow(store.get(), useNow());
  const visits = useVisits(pairs);
  const answered = useRef('');
  const oldest = period.kind === 'all' ? (reach?.from ?? null) : null;
  const span = nowS === null ? null : spanOf(period, nowS, oldest);
  const group = [JSON.stringify(period), points, dayS, ...pairs.map(pairKey)].join('\u0001');
  const fetched = useFetched<Lines>(
    nowS === null || !isOpen || points === 0
      ? null
      : {
          key: [group, epoch, oldest, turnOf(period, nowS), visits].join('\u0001'),
          group,
          paceMs: Math.max(PACE_MS, PACE_A_LINE_MS * pairs.length),
          run: async (signal) => {
            if (answered.current === group) await pause(WRITTEN_MS);
            // The twin's time has gone on since this was wished for.
            const atS = rosNow(store.get(), now()) ?? nowS;
            const requested = spanOf(period, atS, oldest);
            const lines = await fetchLines(
              { pairs, span: requested, nowS: atS, points, dayS },
              signal,
            );
            answered.current = group;
            return lines;
          },
        },
    PACE_MS,
  );
  return {
    lines: fetched.value ?? NO_LINES,
    /** Null while nobody knows what time it is. */
    span,
    /** The time of the twin, ROS seconds. */
    nowS,
    /** While it is fetched again, what was there stays. */
    state: fetched.state,
    message: fetched.message,
  };
}

/** The charts of plans of the same tags, as far as their lines are here. */
export function useCharts(plans: readonly Plan[], points: number, hasDayBefore = false) {
  const unit = useApp((state) => state.settings.unit);
  const moment = useApp((state) => state.view.moment);
  const catalogue = useApp(selectCatalogue);
  const both = useApp(selectCatalogues);
  const species = useSpeciesOf(plans[0]?.tagIds ?? []);
  const pairs = useMemo(
    () => plans.flatMap(({ sensor, tagIds }) => tagIds.map((tagId) => ({ tagId, sensor }))),
    [plans],
  );
  const requested = useLines(pairs, points, hasDayBefore);
  const { lines, span, nowS } = requested;
  const models = useMemo(
    () =>
      span
        ? plans.map((plan) =>
            modelOf(catalogue, both, plan, species, lines, span, unit, moment, nowS),
          )
        : [],
    [catalogue, both, plans, species, lines, span, unit, moment, nowS],
  );
  return { requested, models };
}

/** Changes when one of the tags was visited: not in the past, nor for a period that has ended. */
function useVisits(pairs: readonly Pair[]): string {
  const newest = useApp((state) =>
    state.view.moment === null && endsNow(state.view.period) ? visitsOf(state, pairs) : null,
  );
  const [visits, setVisits] = useState('');
  if (newest !== null && newest !== visits) setVisits(newest);
  return visits;
}

const visitsOf = (state: AppState, pairs: readonly Pair[]): string =>
  JSON.stringify(
    pairs.map(({ tagId }) => {
      const wire = selectLatestTag(state, tagId)?.wire;
      return [wire?.last_observed, wire?.last_try];
    }),
  );

/** What was chosen for the card's chart, and what the map showed then: with another, the card follows it. */
export const chosenSensor = createStore<{ name: string; inView: string } | null>(null);

/** What the card's chart is to show: the sensor in view, unless another was chosen. */
export function useChosenSensor(): string {
  const inView = useApp((state) => state.view.sensor);
  const chosen = useSelected(chosenSensor);
  return chosen?.inView === inView ? chosen.name : inView;
}

/**
 * The sensors that a tag has at the moment that is shown, in their usual order; and what is in view
 * or chosen, where it is computed of them.
 */
export function useSensorsOf(tagId: string): readonly string[] {
  const chosen = useChosenSensor();
  const names = useApp((state) => {
    const readings = selectTag(state, tagId)?.readings;
    if (!readings) return '';
    const computed = [state.view.sensor, chosen].filter((name) => {
      const sensor = selectCatalogue(state).named(name);
      return !isMeasured(sensor) && isHad(sensor, (each) => readings.has(each));
    });
    return [...new Set([...readings.keys(), ...computed])].join('\u0000');
  });
  const catalogue = useApp(selectCatalogue);
  return useMemo(
    () => inOrder(catalogue, names === '' ? [] : names.split('\u0000')),
    [catalogue, names],
  );
}

function useSpeciesOf(tagIds: readonly string[]): readonly string[] {
  const species = useApp((state) =>
    tagIds.map((id) => selectTag(state, id)?.sureSpecies ?? '').join('\u0000'),
  );
  return useMemo(() => species.split('\u0000'), [species]);
}

function inOrder({ all }: Catalogue, names: readonly string[]): readonly string[] {
  const declared = all.map(({ name }) => name).filter((name) => names.includes(name));
  return [...declared, ...names.filter((name) => !declared.includes(name)).sort()];
}

/** A bucket of fewer pixels is a line that nobody can tell from the next. */
const BUCKET_PX = 2;
const STEP = 50;
const MOST = 1_000;

/**
 * So many points or buckets as can be told apart in a chart of that width, in steps: a window
 * that is resized does not ask anew with each pixel. 0 while there is no width.
 */
export const pointsFor = (width: number): number =>
  width === 0 ? 0 : Math.min(MOST, Math.max(100, Math.ceil(width / BUCKET_PX / STEP) * STEP));
