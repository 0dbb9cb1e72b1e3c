/** Where the robot has been and will be, as lines; pure. Times are ROS seconds, lengths metres. */
import type { Robot, RobotNow } from '../contract/types';
import { secondsOf } from '../domain/time';

export interface TrailPoint {
  readonly x: number;
  readonly y: number;
  readonly at: number;
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

export const trailPoint = ({ x, y, observed_at: at }: Robot['trail'][number]): TrailPoint => ({
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

export interface Line {
  readonly points: readonly (readonly [number, number])[];
  /** 0: of now, to 5: two minutes ago. */
  readonly step: number;
}

export const STEPS = 6;

/** The trail in lines that are alike in age; null: the time is not known, and all is the oldest. */
export function trailLines(trail: readonly TrailPoint[], now: number | null): readonly Line[] {
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
