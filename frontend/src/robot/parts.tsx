import '../styles/robot.css';

import { type JSX, type ReactPortal, useEffect, useMemo, useState } from 'react';
import { createPortal } from 'react-dom';

import { answer } from '../contract/api';
import type { Robot, RobotNow, WireTime } from '../contract/types';
import { ageText, percentText, written } from '../domain/format';
import { ageSeconds, ageStep, secondsOf } from '../domain/time';
import { mapPoint, toCanvas } from '../geometry/coordinates';
import { act, type AppState, store, useApp } from '../store/app';
import { robotFrame, useSelected } from '../store/create';
import { createFetcher } from '../store/fetcher';
import { isHeardNow, rosNow, selectShown } from '../store/moment';
import { S } from '../strings';
import { Check } from '../widgets/controls';
import { useTicking } from '../widgets/useNow';
import { extended, trailLines, trailPoint, type TrailPoint, wayAhead } from './path';

/** A position that is older never looks like one of now, s. */
const LIVE_S = 10;
/** The trail is looked at anew so often, s. */
const FADE_S = 10;

/** Where the robot is, has been and will be; to who does not see it, `RobotFact` says so. */
export function RobotLayer(): ReactPortal | null {
  const { position, plan } = useRobot();
  const view = useApp((state) => state.viewport.view);
  const isHeard = useApp(isHeardNow);
  const trail = useTrail();
  const age = useTicking((now) => {
    const known = position && ageOf(position.observed_at, timeOf(store.get(), now));
    return known === null ? null : ageText(known);
  });
  const isLive = useTicking((now) => {
    const known = position && ageOf(position.observed_at, timeOf(store.get(), now));
    return known !== null && known < LIVE_S ? 'live' : 'old';
  });
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
            {looks === 'old' && (
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

/** The layer's entry in the list of layers. */
export function RobotChoice(): JSX.Element {
  const isOn = useApp((state) => state.view.layers.has('robot'));
  return (
    <Check
      label={S.robotLayer}
      isOn={isOn}
      onChange={(on) => {
        act({ type: 'layer', layer: 'robot', on });
      }}
    />
  );
}

/** What the robot has said; how old it is by the twin's time; where it has been. */

const NOTHING: RobotNow = { position: null, plan: null, battery: null };

/** What it says of itself. */
export const useRobot = (): RobotNow => useSelected(robotFrame, (frame) => frame ?? NOTHING);

/** The twin's time, ROS seconds; null where no age is known. */
export const timeOf = (state: AppState, now: number): number | null =>
  selectShown(state).ageing.kind === 'unknown' ? null : rosNow(state, now);

/** How long ago that was, s; null: nobody knows. */
export function ageOf(stamp: WireTime, time: number | null): number | null {
  const at = secondsOf(stamp);
  return time === null || at === 0 ? null : ageSeconds(at * 1_000, time * 1_000);
}

/** Between two tries to get the trail, ms. */
const PACE_MS = 5_000;

/** Where the robot has been: as the bridge has it, and what was heard since. */
export function useTrail(): readonly TrailPoint[] {
  const isOpen = useApp((state) => state.twin.connection.socket.kind === 'open');
  const [trail, setTrail] = useState<readonly TrailPoint[]>([]);
  useEffect(() => {
    if (!isOpen) return undefined;
    const fetcher = createFetcher<Robot>({
      paceMs: PACE_MS,
      onValue: (robot) => {
        setTrail(robot.trail.map(trailPoint));
      },
    });
    fetcher.want({
      key: 'robot',
      group: 'robot',
      run: (signal) => answer('Robot', signal, 'api/robot'),
    });
    return () => {
      fetcher.want(null);
    };
  }, [isOpen]);
  useEffect(
    () =>
      robotFrame.subscribe(() => {
        const position = robotFrame.get()?.position;
        if (position) setTrail((last) => extended(last, position));
      }),
    [],
  );
  return trail;
}
