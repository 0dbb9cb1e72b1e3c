"""What the robot says of itself: where it is, where it has been, its plan, its battery.

Pure. Of now alone: nothing of it is in the journal. Times are ROS time, ns; positions m in the map
frame.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, TypeVar

from lupin_twin.core.state import NANOSECONDS_PER_SECOND

# A stamp that is farther ahead of the twin's time was made by a clock that is wrong.
MAX_AHEAD_NS: Final = 10 * NANOSECONDS_PER_SECOND
# Of the trail: how far back, how close, how many. Past that, what is older is made coarser.
TRAIL_NS: Final = 3600 * NANOSECONDS_PER_SECOND
TRAIL_STEP_M: Final = 0.1
TRAIL_STEP_NS: Final = NANOSECONDS_PER_SECOND
TRAIL_POINTS: Final = 720
# A plan that nobody repeats is none any more after so long, or once the robot is where it ends.
PLAN_NS: Final = 600 * NANOSECONDS_PER_SECOND
ARRIVED_M: Final = 0.5
_FOREVER_NS: Final = 2**63 - 1


@dataclass(frozen=True, slots=True)
class Position:
    """Where the robot was at `at_ns`; `heading` from x towards y, rad; None: it does not say."""

    x: float
    y: float
    heading: float | None
    at_ns: int


@dataclass(frozen=True, slots=True)
class Plan:
    """The way that the robot means to take, as of `at_ns`; without points: none."""

    points: tuple[tuple[float, float], ...]
    at_ns: int


@dataclass(frozen=True, slots=True)
class Battery:
    """How full the battery was at `at_ns`, 0 to 100."""

    percent: float
    at_ns: int


@dataclass(frozen=True, slots=True)
class Robot:
    """What is known of a robot; None: it has not said, or it does not hold any more."""

    position: Position | None = None
    plan: Plan | None = None
    battery: Battery | None = None


ValueT = TypeVar("ValueT", Position, Plan, Battery)


class RobotLog:
    """The newest of each, and the trail of the last hour, bounded."""

    def __init__(self) -> None:
        self.now = Robot()
        self.trail: list[Position] = []
        # Whether the robot has been away from where its plan ends: a round ends where it begins.
        self._was_away = False

    def take(self, heard: Robot, now_ns: int | None) -> bool:
        """Take what was heard since the last time; returns whether anything is another now.

        `now_ns` is the twin's time; None: it is not known. A clock that has gone back makes all
        unknown that would be of the future.
        """
        before = self.now
        future_ns = _FOREVER_NS if now_ns is None else now_ns + MAX_AHEAD_NS
        if now_ns is not None:
            self._cut_trail(now_ns - TRAIL_NS, future_ns)
        position = _newest(before.position, heard.position, future_ns)
        if position is not None and position is heard.position:
            self._extend(position)
        known = _newest(before.plan, None, future_ns)
        plan = _newest(known, heard.plan, future_ns)
        if plan is not None and plan is heard.plan and not (known and _same_end(known, plan)):
            self._was_away = False
        battery = _newest(before.battery, heard.battery, future_ns)
        self.now = Robot(position, self._pending(plan, position, now_ns), battery)
        return self.now != before

    def _cut_trail(self, past_ns: int, future_ns: int) -> None:
        trail = self.trail
        if trail and (trail[0].at_ns < past_ns or trail[-1].at_ns > future_ns):
            self.trail = [it for it in trail if past_ns <= it.at_ns <= future_ns]

    def _extend(self, position: Position) -> None:
        if self.trail:
            last = self.trail[-1]
            if position.at_ns < last.at_ns + TRAIL_STEP_NS or _apart(last, position) < TRAIL_STEP_M:
                return
        self.trail.append(position)
        if len(self.trail) > TRAIL_POINTS:
            del self.trail[1 : TRAIL_POINTS // 2 : 2]

    def _pending(
        self, plan: Plan | None, position: Position | None, now_ns: int | None
    ) -> Plan | None:
        if plan is None or not plan.points:
            return None
        if now_ns is not None and plan.at_ns < now_ns - PLAN_NS:
            return None
        if position is None or position.at_ns < plan.at_ns:
            return plan
        x, y = plan.points[-1]
        is_away = math.hypot(position.x - x, position.y - y) > ARRIVED_M
        self._was_away |= is_away
        return None if self._was_away and not is_away else plan


def _apart(a: Position, b: Position) -> float:
    return math.hypot(a.x - b.x, a.y - b.y)


def _same_end(a: Plan, b: Plan) -> bool:
    return bool(a.points and b.points) and math.dist(a.points[-1], b.points[-1]) <= ARRIVED_M


def _newest(known: ValueT | None, heard: ValueT | None, future_ns: int) -> ValueT | None:
    """What holds of the two; what was known is not, if it would be of the future."""
    if known is not None and known.at_ns > future_ns:
        known = None
    if known is None or (heard is not None and heard.at_ns >= known.at_ns):
        return heard
    return known
