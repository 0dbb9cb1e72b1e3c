"""Makes scans from readings: assigns readings to tags, and averages them over a stop. Pure.

A scan holds each sensor's mean, stamped with the latest reading; its detail states the spread.
Without readings it is a failed attempt, and its detail gives the reason.

All times are ROS time, ns. The robot is at the nearest tag within its reach. It leaves only beyond
1.1 times the reach; otherwise, localisation jitter would split one stop into many scans.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Final

from lupin_twin.adapt.config import Config
from lupin_twin.core.drops import MAX_SENSORS_PER_TAG, MAX_TAGS, MAX_TEXT_LENGTH
from lupin_twin.core.state import NANOSECONDS_PER_SECOND, STATUS_OK, Observation, Pose

LEAVES: Final = 1.1
# A stop of at least this long without a reading is a failed scan; a shorter one just passed by.
STAYED_NS: Final = 2_000_000_000


# Source of a scan: a robot's visit, or a sensor fixed at its tag.
VISIT_SOURCE: Final = "adapt"
FIXED_SOURCE: Final = "adapt/fixed"
# lupin_msgs/Observation
SCAN_FAILED: Final = 2


@dataclass(slots=True)
class _Mean:
    """Running mean and spread (Welford 1962)."""

    number: int = 0
    mean: float = 0.0
    squares: float = 0.0

    def add(self, value: float) -> None:
        self.number += 1
        step = value - self.mean
        self.mean += step / self.number
        self.squares += step * (value - self.mean)

    @property
    def spread(self) -> float:
        """Standard deviation of the readings; 0 for a single one."""
        return math.sqrt(self.squares / (self.number - 1)) if self.number > 1 else 0.0


@dataclass(slots=True)
class _Window:
    """Readings at one tag since `begun_ns`."""

    begun_ns: int
    newest_ns: int = 0
    means: dict[str, _Mean] = field(default_factory=dict)

    def add(self, sensor: str, value: float, stamp_ns: int) -> bool:
        if sensor not in self.means and len(self.means) >= MAX_SENSORS_PER_TAG:
            return False
        self.means.setdefault(sensor, _Mean()).add(value)
        self.newest_ns = max(self.newest_ns, stamp_ns)
        return True


class Scans:
    """Holds the robot's current stop with its readings, and those of each tag's fixed sensors."""

    def __init__(self, config: Config) -> None:
        self._config = config
        # Position of each tag.
        self.places: dict[str, Pose] = dict(config.tags)
        # The tag, or cell, where the robot is; None: at none, or unknown.
        self.tag: str | None = None
        # Position of `tag`, if it is a cell.
        self._cell: Pose | None = None
        self._seen_ns = 0
        self._visit: _Window | None = None
        self._fixed: dict[str, _Window] = {}
        self._now_ns = 0

    def move(self, x: float, y: float, now_ns: int) -> Iterator[Observation]:
        """Move the robot to (x, y), m; yields the scans that end with that."""
        yield from self.due(now_ns)
        self._seen_ns = now_ns
        tag_id = self._nearest(x, y)
        cell_m = self._config.cell_m
        if tag_id is None and cell_m:
            i, j = math.floor(x / cell_m), math.floor(y / cell_m)
            cell = Pose.at((i + 0.5) * cell_m, (j + 0.5) * cell_m)
            yield from self._be_at(f"cell {i} {j}", now_ns, cell)
        else:
            yield from self._be_at(tag_id, now_ns)

    def lose(self, now_ns: int) -> Iterator[Observation]:
        """Note that the robot's position is unknown; yields the scans that end with that."""
        yield from self.due(now_ns)
        yield from self._be_at(None, now_ns)

    def discover(self, tag_id: str, place: Pose, x: float, y: float) -> bool:
        """Add a tag seen from (x, y), m, if it is new and in reach; returns whether it was added.

        Its first position is final, as in the twin: from then on it is like a surveyed tag.
        """
        is_new = tag_id not in self.places and len(self.places) < MAX_TAGS
        if is_new and _distance_m(place, x, y) <= self._config.reach_m:
            self.places[tag_id] = place
            return True
        return False

    def failed(
        self, tag_id: str, detail: str, now_ns: int, *, is_fixed: bool = False
    ) -> Observation:
        """Return a failed attempt at a tag."""
        return self._built(tag_id, now_ns, {}, detail, is_fixed=is_fixed)

    def take(self, sensor: str, tag: str, value: float, stamp_ns: int, now_ns: int) -> bool:
        """Add a reading, in the sensor's unit; returns False if there is no tag or no room for it.

        `tag` is where the sensor is fixed; empty: on the robot.
        """
        if tag:
            if tag not in self._fixed and len(self._fixed) >= MAX_TAGS:
                return False
            window = self._fixed.setdefault(tag, _Window(now_ns))
        elif self._visit is not None:
            window = self._visit
        else:
            return False
        return window.add(sensor, value, stamp_ns)

    def due(self, now_ns: int) -> Iterator[Observation]:
        """Yield the scans whose window is over; call it once a second, and before each move."""
        if now_ns < self._now_ns:  # the clock went back: a new run
            self.tag, self._visit, self._fixed = None, None, {}
        self._now_ns = now_ns
        window_ns = int(self._config.window_s * NANOSECONDS_PER_SECOND)
        for tag_id, window in tuple(self._fixed.items()):
            if now_ns - window.begun_ns >= window_ns:
                del self._fixed[tag_id]
                yield self._scan(tag_id, window, is_fixed=True)
        robot = self._config.robot
        if robot is not None and now_ns - self._seen_ns > robot.max_age_s * NANOSECONDS_PER_SECOND:
            yield from self._be_at(None, now_ns)
        elif self._visit is not None and now_ns - self._visit.begun_ns >= window_ns:
            yield from self._ended(now_ns)
            self._visit = _Window(now_ns)

    def _be_at(
        self, tag_id: str | None, now_ns: int, cell: Pose | None = None
    ) -> Iterator[Observation]:
        if tag_id == self.tag:
            return
        yield from self._ended(now_ns)
        self.tag, self._cell = tag_id, cell
        self._visit = None if tag_id is None else _Window(now_ns)

    def _ended(self, now_ns: int) -> Iterator[Observation]:
        window, tag_id = self._visit, self.tag
        if window is None or tag_id is None:
            return
        if window.means:
            yield self._scan(tag_id, window)
        elif now_ns - window.begun_ns >= STAYED_NS:
            stayed_s = (now_ns - window.begun_ns) / NANOSECONDS_PER_SECOND
            yield self.failed(tag_id, f"no reading in {stayed_s:.0f} s here", now_ns)

    def _scan(self, tag_id: str, window: _Window, *, is_fixed: bool = False) -> Observation:
        means = sorted(window.means.items())
        detail = ", ".join(f"{name} ±{mean.spread:.2g} of {mean.number}" for name, mean in means)
        readings = {name: mean.mean for name, mean in means}
        return self._built(tag_id, window.newest_ns, readings, detail, is_fixed=is_fixed)

    def _built(
        self,
        tag_id: str,
        stamp_ns: int,
        readings: Mapping[str, float],
        detail: str,
        *,
        is_fixed: bool,
    ) -> Observation:
        return Observation(
            tag_id,
            stamp_ns,
            readings,
            self.places.get(tag_id, self._cell if tag_id == self.tag else None),
            STATUS_OK if readings else SCAN_FAILED,
            detail[:MAX_TEXT_LENGTH],
            FIXED_SOURCE if is_fixed else VISIT_SOURCE,
        )

    def _nearest(self, x: float, y: float) -> str | None:
        reach_m, here = self._config.reach_m, self.tag
        if here is not None and _distance_m(self.places.get(here), x, y) > LEAVES * reach_m:
            here = None
        found = min(
            ((_distance_m(place, x, y), tag_id) for tag_id, place in self.places.items()),
            default=(math.inf, ""),
        )
        if found[0] <= reach_m:
            # Hysteresis: another tag has to be nearer by the same margin as for leaving.
            stays = here is not None and (
                _distance_m(self.places.get(here), x, y) - found[0] <= (LEAVES - 1.0) * reach_m
            )
            return here if stays else found[1]
        return here


def _distance_m(place: Pose | None, x: float, y: float) -> float:
    return math.inf if place is None else math.hypot(place.x - x, place.y - y)
