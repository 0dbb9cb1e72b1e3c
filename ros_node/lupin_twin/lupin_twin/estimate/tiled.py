"""The estimate of many tags: the same questions as a `Posterior` answers, each by what is near.

Pure. A field is kriged of nowcasts (`nowcast`, `tiles`). What is asked of single tags or places is
answered exactly from their neighbourhoods (`nearby`). Both by the most probable parameters alone:
those of so many tags are well known.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Final, TypeVar

import numpy as np

from lupin_twin.estimate.advice import Place
from lupin_twin.estimate.cells import Cells, EstimateGrid
from lupin_twin.estimate.changed import Change, Expected, Jury, expected, last_of
from lupin_twin.estimate.kernel import HOURS, Hyper, pairs_of
from lupin_twin.estimate.lattice import STEP_M, Lattice
from lupin_twin.estimate.member import members_of
from lupin_twin.estimate.nearby import Nearby, Neighbourhood
from lupin_twin.estimate.nowcast import nowcasts
from lupin_twin.estimate.posterior import Posterior
from lupin_twin.estimate.readings import IntArray, Readings, Scale
from lupin_twin.estimate.tiles import Tiles
from lupin_twin.grid import FloatArray
from lupin_twin.idw import Abandoned, never

# Places of the lattice at most: a house so large that 0.2 m would make more has a coarser one.
_MOST_PLACES: Final = 250_000
# So many places near a new tag it is to help.
_TARGETS: Final = 64

Told = TypeVar("Told")


@dataclass(frozen=True, slots=False, eq=False)
class TiledPosterior:
    """The estimate as of `at_s` (ROS time, s); `sd_known` is in the sensor's unit.

    It holds the readings and 40 bytes a tag. A field takes 9 bytes a cell, and while it is made
    8 more for each place of the lattice and some 10 megabytes. `should_stop` is asked every few
    milliseconds; whoever asks for something gets an `Abandoned` when it says so.
    """

    scale: Scale
    sd_known: float
    day_length_s: float
    most_probable: Hyper
    readings: Readings
    at_s: float
    should_stop: Callable[[], bool] = never

    @cached_property
    def _tiles(self) -> Tiles:
        ages_h = (self.at_s - self.readings.time_s) * (HOURS / self.day_length_s)
        y = self.scale.standardised(self.readings.value)
        now = nowcasts(self.most_probable, self.readings, y, ages_h, self.should_stop)
        return Tiles(self.most_probable, now)

    @cached_property
    def _nearby(self) -> Nearby:
        return Nearby(self.readings)

    def points(self, xy: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean and sd (k,), in the sensor's unit, at places (k, 2), m."""
        places = np.asarray(xy, dtype=np.float64).reshape(-1, 2)
        mean, variance = self._tiles.at(places, self.should_stop)
        scale = self.scale
        return mean * scale.spread + scale.centre, np.sqrt(variance) * scale.spread

    def grid(
        self,
        *,
        bbox_min_x: float,
        bbox_min_y: float,
        bbox_max_x: float,
        bbox_max_y: float,
        resolution: float,
    ) -> EstimateGrid:
        """The estimate on a grid of cells, as GetField has it. Box and resolution are metres.

        Fine grids are interpolated between places 0.2 m apart, farther in boxes of more than a
        hectare.

        Raises:
            ValueError: see `grid.grid_dimensions`.

        """
        cells = Cells.of(bbox_min_x, bbox_min_y, bbox_max_x, bbox_max_y, resolution)
        area = len(cells.x) * len(cells.y) * cells.resolution**2
        lattice = Lattice(cells.x, cells.y, max(STEP_M, (area / _MOST_PLACES) ** 0.5))
        spread, centre = np.float32(self.scale.spread), np.float32(self.scale.centre)
        x, y = (lattice.x, lattice.y) if lattice.is_coarser else (cells.x, cells.y)
        mean, sd = self._tiles.on(x, y, self.should_stop)
        mean *= spread
        mean += centre
        np.sqrt(sd, out=sd)
        sd *= spread
        if lattice.is_coarser:
            mean, sd = lattice.spread(mean), lattice.spread(sd)
        return cells.filled(mean, sd, self.sd_known)

    def foretell(self, xy: FloatArray, time_s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean and sd (k,) of readings: see `Posterior.foretell`.

        One after the other, each from its neighbourhood, in a few milliseconds.
        """
        places = np.asarray(xy, dtype=np.float64).reshape(-1, 2)
        newest_s = self.readings.time_s.max()
        each = []
        for place, at_s in zip(places, np.asarray(time_s, dtype=np.float64), strict=True):
            if not at_s >= newest_s:
                raise ValueError(f"time_s is {at_s}, before the newest reading, {newest_s}")
            near = self._exactly(self._nearby.at(place))
            each.append(near.foretell(place, np.array([at_s])))
        mean, sd = np.array(each).reshape(-1, 2).T
        return mean, sd

    def changes(self) -> tuple[Change | None, ...]:
        """For each tag, how far its last readings are off; None for a tag without any.

        Half a second for a thousand tags.
        """

        def tell(jury: Jury, _: Readings, block: IntArray) -> Change:
            off = jury.off(block)
            return Change(off.z, off.offset * self.scale.spread)

        return self._of_tags(tell)

    def expected(self) -> tuple[Expected | None, ...]:
        """For each tag, what is foretold for its newest reading; None for a tag without any."""
        return self._of_tags(
            lambda jury, readings, block: expected([jury], readings, block, self.scale)
        )

    def advice(self, places: FloatArray, count: int, *, over: FloatArray) -> list[Place]:
        """The `count` of `places` (k, 2) where other tags help most, m: see `Posterior.advice`.

        Some milliseconds for each of `places`. What a reading tells of all but the 64 nearest of
        `over` (m, 2) is not counted.
        """
        candidates, targets = (
            np.asarray(one, dtype=np.float64).reshape(-1, 2) for one in (places, over)
        )
        if not len(targets):
            raise ValueError("there is nowhere that a tag is to help")
        nearby, readings = self._nearby, self.readings
        at_first = float(self._tiles.at(targets, self.should_stop)[1].sum())
        left, result = at_first, list[Place]()
        # No gain grows by another reading: what is best after being looked at again is best of all.
        gains = [self._gain(nearby, one, targets) for one in candidates]
        is_fresh = [True] * len(gains)
        for _ in range(min(count, len(candidates))):
            while not is_fresh[best := int(np.argmax(gains))]:
                gains[best] = self._gain(nearby, candidates[best], targets)
                is_fresh[best] = True
            left = max(left - gains[best], 0.0)
            x, y = candidates[best].tolist()
            result.append(Place(x, y, (left / at_first) ** 0.5))
            gains[best] = -np.inf
            is_fresh = [False] * len(gains)
            readings = readings.with_one_more(self.at_s, candidates[best], self.scale.centre)
            nearby = Nearby(readings)
        return result

    def _gain(self, nearby: Nearby, place: FloatArray, targets: FloatArray) -> float:
        """By how much a reading now at a place (2,) lessens the sum of the variances at targets."""
        near = self._exactly(nearby.at(place))
        (member,), tags = near.members, near.readings.xy
        far = np.square(targets - place).sum(axis=1)
        those = targets[np.argsort(far, kind="stable")[:_TARGETS]]
        here = member.near(place[None, :], tags)
        between = member.nearness(those, place[None, :])
        shared = member.shared(member.near(those, tags), here, between)
        spread = max(float(member.moments(here)[1][0]), 0.0) + member.noise
        return float(np.square(shared).sum()) / spread

    def _of_tags(self, tell: Callable[[Jury, Readings, IntArray], Told]) -> tuple[Told | None, ...]:
        result: list[Told | None] = [None] * len(self.readings.xy)
        for near in self._nearby.all():
            if self.should_stop():
                raise Abandoned
            pairs = pairs_of(near.readings, self.day_length_s)
            y = self.scale.standardised(near.readings.value)
            jury = Jury(self.most_probable, pairs, y)
            for row in near.judged.tolist():
                block = last_of(near.readings, row)
                result[near.tags[row]] = tell(jury, near.readings, block)
        return tuple(result)

    def _exactly(self, near: Neighbourhood) -> Posterior:
        if self.should_stop():
            raise Abandoned
        pairs = pairs_of(near.readings, self.day_length_s)
        y = self.scale.standardised(near.readings.value)
        later_h = (self.at_s - near.readings.time_s.max()) * (HOURS / self.day_length_s)
        members = members_of([self.most_probable], pairs, y, later_h)
        return Posterior(
            self.scale,
            self.sd_known,
            self.day_length_s,
            self.most_probable,
            near.readings,
            members,
        )
