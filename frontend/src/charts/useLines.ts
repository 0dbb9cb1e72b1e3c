import { useRef, useState } from 'react';

import { now, pause } from '../clock';
import { endsNow, spanOf, type Span } from '../domain/period';
import { store, useApp, type AppState } from '../store/app';
import { rosNow, selectNewestTag } from '../store/moment';
import { selectDayS } from '../store/origin';
import { turnOf } from '../store/remembered';
import type { Fetched } from '../store/fetcher';
import { useFetched } from '../store/useFetched';
import { useNow } from '../widgets/useNow';
import { fetchLines, NO_LINES, pairKey, type Lines, type Pair } from './lines';

/** Between two questions about the same lines, ms; of many lines longer. */
const PACE_MS = 3_000;
const PACE_A_LINE_MS = 1_000;
/** What was heard is in the journal within 100 ms, and in another host's copy of it soon after. */
const WRITTEN_MS = 1_000;

export interface Asked {
  readonly lines: Lines;
  /** "missing": this twin keeps no past. While it is fetched again, what was there stays. */
  readonly state: Fetched<Lines>['state'] | 'missing';
  /** Why there is nothing, for a person to read. */
  readonly message: string;
  /** The period of the time bar; null while nobody knows what time it is. */
  readonly span: Span | null;
  /** The time of the twin, ROS seconds. */
  readonly nowS: number | null;
}

/**
 * What these lines have over the period of the time bar: asked for again when one of the tags was
 * visited, on each connection, and now and then.
 */
export function useLines(pairs: readonly Pair[], points: number, hasDayBefore = false): Asked {
  const period = useApp((state) => state.view.period);
  const remembered = useApp((state) => state.twin.remembered);
  const epoch = useApp((state) => state.twin.connection.epoch);
  const isOpen = useApp((state) => state.twin.connection.socket.kind === 'open');
  const dayS = useApp((state) => (hasDayBefore ? selectDayS(state) : null));
  const nowS = rosNow(store.get(), useNow());
  const visits = useVisits(pairs);
  const answered = useRef('');
  const isOff = remembered.state === 'off';
  const oldest = period.kind === 'all' ? (remembered.value?.reach?.from ?? null) : null;
  const span = nowS === null ? null : spanOf(period, nowS, oldest);
  const group = [JSON.stringify(period), points, dayS, ...pairs.map(pairKey)].join('\u0001');
  const fetched = useFetched<Lines>(
    nowS === null || isOff || !isOpen || points === 0
      ? null
      : {
          key: [group, epoch, oldest, turnOf(period, nowS), visits].join('\u0001'),
          group,
          paceMs: Math.max(PACE_MS, PACE_A_LINE_MS * pairs.length),
          run: async (signal) => {
            if (answered.current === group) await pause(WRITTEN_MS);
            // The twin's time has gone on since this was wished for.
            const atS = rosNow(store.get(), now()) ?? nowS;
            const asked = spanOf(period, atS, oldest);
            const lines = await fetchLines({ pairs, span: asked, nowS: atS, points, dayS }, signal);
            answered.current = group;
            return lines;
          },
        },
    PACE_MS,
  );
  return {
    ...{ lines: fetched.value ?? NO_LINES, span, nowS },
    ...(isOff ? { state: 'missing', message: remembered.message } : fetched),
  };
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

/** When each was observed last, and tried last. */
const visitsOf = (state: AppState, pairs: readonly Pair[]): string =>
  JSON.stringify(
    pairs.map(({ tagId }) => {
      const wire = selectNewestTag(state, tagId)?.wire;
      return [wire?.last_observed, wire?.last_try];
    }),
  );
