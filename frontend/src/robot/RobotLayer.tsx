import { useMemo, type ReactPortal } from 'react';
import { createPortal } from 'react-dom';

import { ageText } from '../domain/format';
import { mapPoint, toCanvas } from '../geometry/coordinates';
import { store, useApp } from '../store/app';
import { isHeardNow } from '../store/moment';
import { S } from '../strings';
import { useTicking } from '../widgets/useNow';
import { ageOf, timeOf, useRobot, useTrail } from './heard';
import { trailLines, wayAhead } from './path';

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
