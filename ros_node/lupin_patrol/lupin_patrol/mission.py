"""The simulated patrol: an endless, repeatable sequence of events, as plain data.

`at_s` is patrol time, in seconds since the start; the node plays it faster or slower. Positions are
metres in the map frame, times of day are seconds since simulated midnight. The robot is faster
than real ones, so that a demo shows the whole greenhouse within a minute.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import IntEnum
from itertools import count
from math import atan2, cos, dist, sin
from typing import Any, Final

from lupin_patrol.greenhouse import (
    TAG_HEIGHT_M,
    Point,
    Roadmap,
    Tag,
    read_greenhouse,
    tour,
    walk,
)
from lupin_patrol.perception import (
    SECONDS_PER_DAY,
    Exploration,
    Grid,
    Plants,
    readings_at,
    stream,
)
from lupin_twin.core.state import KIND_FLOWER, Observation, Pin, Pose, Write


class ScanStatus(IntEnum):
    """How a scan went: lupin_msgs/Observation's STATUS_*."""

    OK = 0
    UNREACHABLE = 1
    SCAN_FAILED = 2


def pose_of(position: Point, yaw: float) -> Pose:
    """Return a tag's pose; `yaw` (rad, from x towards y) points from the tag into the aisle."""
    return Pose(*position, TAG_HEIGHT_M, 0.0, 0.0, sin(yaw / 2), cos(yaw / 2))


@dataclass(frozen=True, slots=True)
class MapGrown:
    """More cells of the map have become known."""

    at_s: float
    grid: Grid


@dataclass(frozen=True, slots=True)
class TagsDiscovered:
    """Perception's list of all tags seen so far, sent when it grows and at the end of each pass."""

    at_s: float
    tags: tuple[Tag, ...]


@dataclass(frozen=True, slots=True)
class Visited:
    """One attempt to scan a tag, or one inspection of its plants; the node adds the stamps.

    A failed scan has neither readings nor a pose. The footprint of an inspection is the outline of
    the plants' table.
    """

    at_s: float
    pass_index: int
    time_of_day_s: float
    write: Observation


@dataclass(frozen=True, slots=True)
class PassCompleted:
    """Every tag was visited, and failed ones were retried; `failed` lists those without a scan."""

    at_s: float
    pass_index: int
    failed: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class WayPlanned:
    """The robot sets out along this planned path; the last point is its goal."""

    at_s: float
    way: tuple[Point, ...]


@dataclass(frozen=True, slots=True)
class RobotMoved:
    """The robot's pose and its battery level, 0 to 1; `yaw` is rad from x towards y."""

    at_s: float
    position: Point
    yaw: float
    battery: float


Event = MapGrown | TagsDiscovered | Visited | PassCompleted | WayPlanned | RobotMoved


DOCK: Point = (0.4, 0.4)
START_OF_DAY_S = 9 * 3600.0

_ROBOT_SPEED_M_S = 1.2
_OBSERVE_PERIOD_S = 0.2
_MAP_PERIOD_S = 1.0
_READ_S = 0.3
_PICTURE_S = 0.2
# A tag within this distance is seen.
_TAG_RANGE_M = 1.2
# Range of a full battery; the dock recharges it completely.
_BATTERY_M = 400.0

_FAILURES_A_PASS = 2
_RETRY_FAILS = 0.3
_DETAILS = {
    ScanStatus.OK: "",
    ScanStatus.UNREACHABLE: "the way to the tag is blocked",
    ScanStatus.SCAN_FAILED: "the tag was not decoded in 3 pictures",
}


class Mission:
    """One robot on patrol in the simulator's greenhouse.

    `day_speed` is how many simulated seconds pass in one second of patrol time. The robot leaves
    its dock at `begin_s`, but it is always nine o'clock at patrol time 0. Passes count from
    `first_pass`, and no two passes are alike.
    """

    def __init__(
        self,
        simulator: Any,
        seed: int,
        day_speed: float,
        *,
        begin_s: float = 0.0,
        first_pass: int = 0,
    ) -> None:
        self.greenhouse = read_greenhouse(simulator)
        self._sensors = simulator.sensor_registry
        self._plants = Plants(self.greenhouse, seed, first_pass)
        self._roadmap = Roadmap(self.greenhouse)
        self._exploration = Exploration(self.greenhouse)
        self._seen: tuple[Tag, ...] = ()
        self._seed = seed
        self._day_speed = day_speed
        self._position = DOCK
        self._yaw = 0.0
        self._battery_m = _BATTERY_M
        self._now_s = begin_s
        self._first_pass = first_pass
        self._is_observing = True
        self._map_due_s = begin_s
        self._map_is_new = False
        order = tour(self._roadmap, DOCK, [tag.stop for tag in self.greenhouse.tags])
        self._tour = [self.greenhouse.tags[index] for index in order]

    def events(self) -> Iterator[Event]:
        """Patrol forever. Call it once: the mission holds the state of one robot."""
        yield from self._observe()
        for pass_index in count(self._first_pass):
            yield from self._patrol(pass_index)
            yield from self._drive(DOCK)
            self._battery_m = _BATTERY_M

    def visits(self) -> Iterator[Visited]:
        """Yield only the visits of `events`, at a tenth of the work: no observing on the way."""
        self._is_observing = False
        for event in self.events():
            if isinstance(event, Visited):
                yield event

    def _patrol(self, pass_index: int) -> Iterator[Event]:
        """Visit every tag once, then the failed ones again."""
        planned = self._planned_failures(pass_index)
        failed: list[Tag] = []
        for tag in self._tour:
            status = planned.get(tag.tag_id, ScanStatus.OK)
            yield from self._visit(tag, pass_index, 0, status)
            if status is not ScanStatus.OK:
                failed.append(tag)
        lost = []
        for tag in failed:
            status = self._retry_status(tag, pass_index)
            yield from self._visit(tag, pass_index, 1, status)
            if status is not ScanStatus.OK:
                lost.append(tag.tag_id)
        if self._map_is_new:
            yield self._map()
        yield TagsDiscovered(self._now_s, self._seen)
        yield PassCompleted(self._now_s, pass_index, tuple(lost))

    def _planned_failures(self, pass_index: int) -> dict[str, ScanStatus]:
        """Choose the tags whose first attempt fails: in every pass, one for each failed status."""
        chance = stream(self._seed, "failures", pass_index)
        tags = chance.sample([tag.tag_id for tag in self.greenhouse.tags], _FAILURES_A_PASS)
        return dict(zip(tags, (ScanStatus.UNREACHABLE, ScanStatus.SCAN_FAILED), strict=True))

    def _retry_status(self, tag: Tag, pass_index: int) -> ScanStatus:
        """Decide how a retry ends. In the first pass it succeeds, so a demo shows every tag."""
        chance = stream(self._seed, "retry", tag.tag_id, pass_index)
        fails = pass_index > self._first_pass and chance.random() < _RETRY_FAILS
        return ScanStatus.SCAN_FAILED if fails else ScanStatus.OK

    def _visit(
        self, tag: Tag, pass_index: int, attempt: int, status: ScanStatus
    ) -> Iterator[Event]:
        yield from self._drive(tag.stop)
        self._now_s += _READ_S
        time_of_day_s = (START_OF_DAY_S + self._now_s * self._day_speed) % SECONDS_PER_DAY
        pose: Pose | None = None
        readings: dict[str, float] = {}
        if status is ScanStatus.OK:
            chance = stream(self._seed, "scan", tag.tag_id, pass_index, attempt)
            pose = pose_of(tag.position, tag.yaw)
            readings = readings_at(self._sensors, tag.sensors, tag.position, time_of_day_s, chance)
        scan = Observation(tag.tag_id, 0, readings, pose, status, _DETAILS[status])
        yield Visited(self._now_s, pass_index, time_of_day_s, scan)
        if pose is not None:
            self._now_s += _PICTURE_S
            flower = self._plants.inspect(tag.tag_id, pass_index, attempt)
            seen = Observation(tag.tag_id, 0, pose=pose, kind=KIND_FLOWER, flower=flower)
            yield Visited(self._now_s, pass_index, time_of_day_s, seen)

    def _drive(self, goal: Point) -> Iterator[Event]:
        """Drive to a goal, and observe on the way."""
        way = self._roadmap.way(self._position, goal)
        if self._is_observing:
            yield WayPlanned(self._now_s, tuple(way))
        step_m = _ROBOT_SPEED_M_S * _OBSERVE_PERIOD_S
        for position, driven_m in walk(way, step_m):
            (x, y), self._position = self._position, position
            if position != (x, y):
                self._yaw = atan2(position[1] - y, position[0] - x)
            self._now_s += driven_m / _ROBOT_SPEED_M_S
            self._battery_m -= driven_m
            yield from self._observe()

    def _observe(self) -> Iterator[Event]:
        if not self._is_observing:
            return
        battery = self._battery_m / _BATTERY_M
        yield RobotMoved(self._now_s, self._position, self._yaw, battery)
        new = [
            tag
            for tag in self.greenhouse.tags
            if tag not in self._seen and dist(tag.edge, self._position) <= _TAG_RANGE_M
        ]
        if new:
            self._seen = (*self._seen, *new)
            yield TagsDiscovered(self._now_s, self._seen)
        self._map_is_new |= self._exploration.observe_from(self._position)
        if self._map_is_new and self._now_s >= self._map_due_s:
            yield self._map()

    def _map(self) -> MapGrown:
        self._map_is_new = False
        self._map_due_s = self._now_s + _MAP_PERIOD_S
        return MapGrown(self._now_s, self._exploration.snapshot())


# --- the past: what the patrol would have observed in the last three simulated days ---------------

PAST_SOURCE: Final = "lupin_patrol (simulated past)"
DAYS: Final = 3
# Far below the patrol's own pass numbers: no simulated past pass repeats one of them.
_FIRST_PASS: Final = -1_000_000


def past(simulator: Any, seed: int, day_speed: float, speed: float, now_ns: int) -> Iterator[Write]:
    """Yield what a twin would have written until now, oldest first; nothing if `day_speed` is 0.

    Positions, plants, climate and time of day match the patrol with the same seed. The past ends
    at `now_ns`, where that patrol begins.
    """
    if day_speed <= 0.0:
        return
    begin_s = -DAYS * SECONDS_PER_DAY / day_speed
    mission = Mission(simulator, seed, day_speed, begin_s=begin_s, first_pass=_FIRST_PASS)
    pinned: set[str] = set()
    for event in mission.visits():
        if event.at_s >= 0.0:
            return
        write, at_ns = event.write, now_ns + round(event.at_s / speed * 1e9)
        if write.pose is not None and write.tag_id not in pinned:
            pinned.add(write.tag_id)
            yield Pin(write.tag_id, write.pose, at_ns, at_ns)
        yield replace(
            write,
            stamp_ns=at_ns,
            pose=None,
            source=PAST_SOURCE,
            own_stamp_ns=at_ns,
            mission=f"past-{event.pass_index - _FIRST_PASS + 1:04d}",
            arrival_ns=at_ns,
        )
