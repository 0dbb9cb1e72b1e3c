import '../styles/robot.css';

import { type JSX, type ReactPortal, useEffect, useState } from 'react';
import { createPortal } from 'react-dom';

import { answer } from '../contract/api';
import type { Robot, RobotNow } from '../contract/types';
import { ageText, percentText, written } from '../domain/format';
import { ageSeconds, ageStep } from '../domain/time';
import { mapPoint, toCanvas } from '../geometry/coordinates';
import { act, keepFetched, store, useApp } from '../store/app';
import { withLayer } from '../store/view';
import { keepClear, robotFrame, useSelected } from '../store/create';
import { isReceivingNow, latestTime, selectLatest } from '../store/moment';
import { S } from '../strings';
import { Check } from '../widgets/controls';
import { useTicking } from '../widgets/useNow';

/** An older position never looks live, s. */
const LIVE_S = 10;

/** The robot's position, trail and plan; `RobotFact` has them in words for screen readers. */
export function RobotLayer(): ReactPortal | null {
  const { position, plan } = useRobot();
  const view = useApp((state) => state.viewport.view);
  const isReceiving = useApp(isReceivingNow);
  const trail = useTrail();
  const ageAt = (now: number): number | null =>
    position && ageOf(position.observed_at, latestTime(store.get(), now));
  const age = useTicking((now) => {
    const known = ageAt(now);
    return known === null ? null : ageText(known);
  });
  const cutAt = useApp((state) =>
    isReceivingNow(state) ? undefined : selectLatest(state).snapshot?.takenAt,
  );
  // While nothing arrives, the banner gives the age; the mark ages only if it was old before.
  const isLive = useTicking((now) => ((ageAt(cutAt ?? now) ?? LIVE_S) < LIVE_S ? 'live' : 'old'));
  const looks = isLive === 'live' && isReceiving ? 'live' : 'old';
  const at = position && toCanvas(view, mapPoint(position.x, position.y));
  useClearOfLabels(at && [at.x - view.x, at.y - view.y], isLive === 'old');
  const map = document.getElementById('map-view');
  if (!map) return null;
  // Inside the map, below everything drawn over it.
  return createPortal(
    <>
      <svg className="robot-layer" aria-hidden="true" data-testid="robot" data-freshness={looks}>
        <g transform={`translate(${view.x} ${view.y}) scale(${view.scale} ${-view.scale})`}>
          <path className="robot-trail" d={trailPath(trail)} />
          <path className="robot-recent" d={trailPath(trail.slice(-RECENT_POINTS))} />
          {plan && (
            <polyline
              className="robot-plan"
              points={plan.points.map((point) => point.join(',')).join(' ')}
            />
          )}
        </g>
      </svg>
      {position && at && (
        <svg className="robot-layer robot-now" aria-hidden="true" data-freshness={looks}>
          <g transform={`translate(${at.x} ${at.y})`} data-testid="robot-mark">
            <circle className="robot-ring" r="16" />
            <circle className="robot-body" r="11" />
            {position.heading === null ? (
              <circle className="robot-heading" r="4" />
            ) : (
              <path
                className="robot-heading"
                d="M8 0-5 5.500-2 0-5-5.500Z"
                transform={`rotate(${(-position.heading * 180) / Math.PI})`}
              />
            )}
            {isLive === 'old' && (
              <text className="robot-age" x="16" y="4">
                {age === null ? S.ageUnknown : S.agoSuffix(age)}
              </text>
            )}
          </g>
        </svg>
      )}
    </>,
    map,
  );
}

/** Half the mark and width of its age, pixels. */
const MARK_PX = 17;
const AGE_PX = 84;
/** Labels move in steps: they do not jump with each position. */
const CLEAR_STEP_PX = 12;

/** Keeps labels off the mark; `at`: its middle, pixels from the map's origin. */
function useClearOfLabels(at: readonly [number, number] | null, hasAge: boolean): void {
  const start = (value: number): number =>
    Math.floor((value - MARK_PX) / CLEAR_STEP_PX) * CLEAR_STEP_PX;
  const left = at && start(at[0]);
  const top = at && start(at[1]);
  useEffect(() => {
    if (left === null || top === null) return undefined;
    const size = 2 * MARK_PX + CLEAR_STEP_PX;
    return keepClear([
      { left, top, right: left + size + (hasAge ? AGE_PX : 0), bottom: top + size },
    ]);
  }, [left, top, hasAge]);
}

const metres = (value: number): string => written(value.toFixed(1));

/** Position and battery in words, for the legend and screen readers. */
export function robotText({ position, battery }: RobotNow, time: number | null): string {
  const ago = (age: number | null): string =>
    age === null ? S.robotAgeUnknown : S.agoSuffix(ageText(age));
  const parts = position
    ? [S.robotAt(metres(position.x), metres(position.y)), ago(ageOf(position.observed_at, time))]
    : [S.robotNowhere];
  if (battery) {
    const percent = percentText(battery.percent / 100);
    const age = ageOf(battery.observed_at, time);
    parts.push(
      ageStep(age) === 'fresh' ? S.robotBattery(percent) : S.robotReported(percent, ago(age)),
    );
  }
  return parts.join('; ');
}

export function RobotFact(): JSX.Element | null {
  const robot = useRobot();
  const text = useTicking((now) => robotText(robot, latestTime(store.get(), now)));
  if (!robot.position && !robot.battery) return null;
  return (
    <span className="robot-fact" data-testid="robot-fact">
      {text}
    </span>
  );
}

export function RobotChoice(): JSX.Element {
  const isOn = useApp((state) => state.view.layers.has('robot'));
  return <Check label={S.robotLayer} isOn={isOn} onChange={(on) => act(withLayer('robot', on))} />;
}

const NOTHING: RobotNow = { position: null, plan: null, battery: null };

export const useRobot = (): RobotNow => useSelected(robotFrame, (frame) => frame ?? NOTHING);

/** Age in seconds; null: unknown. */
export const ageOf = (at: number, time: number | null): number | null =>
  at === 0 ? null : ageSeconds(at, time);

/** Pause between attempts to fetch the trail, ms. */
const PACE_MS = 5_000;

/** The robot's trail: fetched from the bridge, then extended by received positions. */
function useTrail(): readonly Point[] {
  const [trail, setTrail] = useState<readonly Point[]>([]);
  useEffect(() => {
    const gone = new AbortController();
    keepFetched<Robot>(
      { paceMs: PACE_MS, onValue: ({ trail }) => setTrail((last) => joined(trail, last)) },
      ({ twin }) =>
        twin.connection.socket.kind === 'open'
          ? { key: 'robot', run: (signal) => answer(signal, 'api/robot', ['trail']) }
          : null,
      gone.signal,
    );
    robotFrame.subscribe(() => {
      const position = robotFrame.get()?.position;
      if (position) setTrail((last) => extended(last, position));
    }, gone.signal);
    return () => gone.abort();
  }, []);
  return trail;
}

type Point = Robot['trail'][number];

/** About the last round. */
const RECENT_POINTS = 40;
/** Age of the oldest point, s. */
const TRAIL_S = 3_600;
/** Least distance between two points, as in the bridge, m. */
const STEP_M = 0.1;
/** The way between points farther apart is unknown, m. */
const GAP_M = 3;

/** The trail with one more point; unchanged if that is too close. A clock that went back drops later ones. */
export function extended(trail: readonly Point[], next: Point): readonly Point[] {
  const last = trail.at(-1);
  const ageOfPoint = (it: Point): number => next.observed_at - it.observed_at;
  if (last && ageOfPoint(last) >= 0 && apart(last, next) < STEP_M) return trail;
  return [...trail.filter((it) => ageOfPoint(it) >= 0 && ageOfPoint(it) <= TRAIL_S), next];
}

/** A fetched trail, with the positions received while it was fetched. */
export function joined(fetched: readonly Point[], received: readonly Point[]): readonly Point[] {
  const end = fetched.at(-1)?.observed_at ?? Infinity;
  return [...fetched, ...received.filter((it) => it.observed_at > end)];
}

/** The trail as an SVG path in metres, with a break where the way is unknown. */
export const trailPath = (trail: readonly Point[]): string =>
  trail
    .map((it, index) => {
      const last = trail[index - 1];
      return `${last && apart(last, it) <= GAP_M ? 'L' : 'M'}${it.x} ${it.y}`;
    })
    .join('');

const apart = (a: Point, b: Point): number => Math.hypot(a.x - b.x, a.y - b.y);
