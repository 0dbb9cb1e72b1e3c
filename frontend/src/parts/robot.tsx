import '../styles/robot.css';

import { type JSX, type ReactPortal, useEffect, useMemo, useState } from 'react';
import { createPortal } from 'react-dom';

import { answer } from '../contract/api';
import type { Robot, RobotNow, WireTime } from '../contract/types';
import { ageText, percentText, written } from '../domain/format';
import { ageSeconds, ageStep, secondsOf } from '../domain/time';
import { mapPoint, toCanvas } from '../geometry/coordinates';
import { act, type AppState, keepFetched, store, useApp } from '../store/app';
import { withLayer } from '../store/view';
import { robotFrame, useSelected } from '../store/create';
import { isHeardNow, rosNow, selectIsCut, selectNewest, selectShown } from '../store/moment';
import { S } from '../strings';
import { Check } from '../widgets/controls';
import { useTicking } from '../widgets/useNow';

/** A position that is older never looks like one of now, s. */
const LIVE_S = 10;
const FADE_S = 10;

/** Where the robot is, has been and will be; to who does not see it, `RobotFact` says so. */
export function RobotLayer(): ReactPortal | null {
  const { position, plan } = useRobot();
  const view = useApp((state) => state.viewport.view);
  const isHeard = useApp(isHeardNow);
  const trail = useTrail();
  const ageAt = (now: number): number | null =>
    position && ageOf(position.observed_at, timeOf(store.get(), now));
  const age = useTicking((now) => {
    const known = ageAt(now);
    return known === null ? null : ageText(known);
  });
  const cutAt = useApp((state) =>
    selectIsCut(state) ? selectNewest(state).snapshot?.takenAt : undefined,
  );
  // Cut off, the banner says how old all is: only what was old by then has more to say.
  const isLive = useTicking((now) => ((ageAt(cutAt ?? now) ?? LIVE_S) < LIVE_S ? 'live' : 'old'));
  const time = useTicking((now) => {
    const known = timeOf(store.get(), now);
    return known === null ? null : String(Math.floor(known / FADE_S) * FADE_S);
  });
  const lines = useMemo(
    () => trailLines(trail, time === null ? null : Number(time)),
    [trail, time],
  );
  const looks = isLive === 'live' && isHeard ? 'live' : 'old';
  const at = position && toCanvas(view, mapPoint(position.x, position.y));
  const text = (points: readonly (readonly [number, number])[]): string =>
    points.map((point) => point.join(',')).join(' ');
  const map = document.getElementById('map-view');
  if (!map) return null;
  // Within the map: below all that stands on it.
  return createPortal(
    <>
      <svg className="robot-layer" aria-hidden="true" data-testid="robot" data-looks={looks}>
        <g transform={`translate(${view.x} ${view.y}) scale(${view.scale} ${-view.scale})`}>
          {lines.map(({ points, step }, index) => (
            <polyline key={index} className="robot-trail" data-step={step} points={text(points)} />
          ))}
          {plan && (
            <polyline className="robot-plan" points={text(wayAhead(plan.points, position))} />
          )}
        </g>
      </svg>
      {position && at && (
        <svg className="robot-layer robot-now" aria-hidden="true" data-looks={looks}>
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

const metres = (value: number): string => written(value.toFixed(1));

/** All of it in words: for the legend, and for who does not see the map. */
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
  const text = useTicking((now) => robotText(robot, timeOf(store.get(), now)));
  if (!robot.position && !robot.battery) return null;
  return (
    <span className="robot-fact" data-testid="robot-fact">
      {text}
    </span>
  );
}

export function RobotChoice(): JSX.Element {
  const isOn = useApp((state) => state.view.layers.has('robot'));
  return (
    <Check
      label={S.robotLayer}
      isOn={isOn}
      onChange={(on) => {
        act(withLayer('robot', on));
      }}
    />
  );
}

const NOTHING: RobotNow = { position: null, plan: null, battery: null };

export const useRobot = (): RobotNow => useSelected(robotFrame, (frame) => frame ?? NOTHING);

/** The twin's time, ROS seconds; null where no age is known. */
const timeOf = (state: AppState, now: number): number | null =>
  selectShown(state).ageing.kind === 'unknown' ? null : rosNow(state, now);

/** Seconds; null: nobody knows. */
export function ageOf(stamp: WireTime, time: number | null): number | null {
  const at = secondsOf(stamp);
  return time === null || at === 0 ? null : ageSeconds(at * 1_000, time * 1_000);
}

/** Between two tries to get the trail, ms. */
const PACE_MS = 5_000;

/** Where the robot has been: as the bridge has it, and what was heard since. */
function useTrail(): readonly TrailPoint[] {
  const [trail, setTrail] = useState<readonly TrailPoint[]>([]);
  useEffect(() => {
    const stop = keepFetched<Robot>(
      {
        paceMs: PACE_MS,
        onValue: (robot) => {
          setTrail(robot.trail.map(trailPoint));
        },
      },
      ({ twin }) =>
        twin.connection.socket.kind === 'open'
          ? { key: 'robot', run: (signal) => answer('Robot', signal, 'api/robot') }
          : null,
    );
    const unhear = robotFrame.subscribe(() => {
      const position = robotFrame.get()?.position;
      if (position) setTrail((last) => extended(last, position));
    });
    return () => {
      stop();
      unhear();
    };
  }, []);
  return trail;
}

type Position = NonNullable<RobotNow['position']>;

/** As the bridge keeps them: no closer in place, nor in time. */
const STEP_M = 0.1;
const STEP_S = 1;
/** Longer, and the trail of a patrol hides what it crosses. */
const TRAIL_S = 120;
/** More than the bridge keeps of an hour; past it the oldest go. */
const MOST_POINTS = 2_000;
/** Where nothing was heard for so long, and it is far away then, nobody knows how it went there. */
const GAP_S = 60;
const GAP_M = 1;

/** ROS seconds, metres. */
export type TrailPoint = ReturnType<typeof trailPoint>;

const trailPoint = ({ x, y, observed_at: at }: Robot['trail'][number]) => ({
  x,
  y,
  at: secondsOf(at),
});

/** The trail with one position more; the same one where that is too near. */
export function extended(trail: readonly TrailPoint[], position: Position): readonly TrailPoint[] {
  const next = trailPoint(position);
  const last = trail.at(-1);
  // A clock that went back: what was later is of no time any more.
  if (last && next.at < last.at - GAP_S) return [next];
  if (last && (next.at < last.at + STEP_S || apart(last, next) < STEP_M)) return trail;
  return [...trail.slice(1 - MOST_POINTS), next];
}

export const STEPS = 6;

/**
 * The trail in lines that are alike in age, from step 0, now, to 5, two minutes ago. Null: the time is not
 * known, and all is the oldest.
 */
export function trailLines(trail: readonly TrailPoint[], now: number | null) {
  const lines: { points: [number, number][]; step: number }[] = [];
  let last: TrailPoint | null = null;
  for (const point of trail) {
    const age = now === null ? TRAIL_S : Math.max(0, now - point.at);
    if (now !== null && age > TRAIL_S) continue;
    const step = Math.min(STEPS - 1, Math.floor((age / TRAIL_S) * STEPS));
    const line = lines.at(-1);
    const isApart = last !== null && point.at - last.at > GAP_S && apart(last, point) > GAP_M;
    if (line && !isApart) {
      line.points.push([point.x, point.y]);
      if (line.step !== step) lines.push({ points: [[point.x, point.y]], step });
    } else {
      lines.push({ points: [[point.x, point.y]], step });
    }
    last = point;
  }
  return lines.filter(({ points }) => points.length > 1);
}

/** What is left of the way from where the robot is: from the part of it that it is nearest to. */
export function wayAhead(
  points: readonly (readonly number[])[],
  position: { readonly x: number; readonly y: number } | null,
): readonly (readonly [number, number])[] {
  const way = points.map(([x = 0, y = 0]) => [x, y] as const);
  if (!position) return way;
  let nearest = Infinity;
  let next = way.length - 1;
  for (let index = 1; index < way.length; index++) {
    const from = way[index - 1] ?? [0, 0];
    const to = way[index] ?? [0, 0];
    const distance = distanceTo(position, from, to);
    if (distance < nearest) {
      nearest = distance;
      next = index;
    }
  }
  return [[position.x, position.y], ...way.slice(next)];
}

type Place = readonly [number, number];

/** How far a point is from a stretch between two others. */
function distanceTo({ x, y }: { x: number; y: number }, from: Place, to: Place): number {
  const [dx, dy] = [to[0] - from[0], to[1] - from[1]];
  const length = dx * dx + dy * dy;
  const along = length === 0 ? 0 : ((x - from[0]) * dx + (y - from[1]) * dy) / length;
  const share = Math.min(1, Math.max(0, along));
  return Math.hypot(x - from[0] - share * dx, y - from[1] - share * dy);
}

const apart = (a: TrailPoint, b: TrailPoint): number => Math.hypot(a.x - b.x, a.y - b.y);
