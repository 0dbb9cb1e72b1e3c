"""The estimate as of a moment: its mean and its error anywhere, and what it makes of each tag.

Pure. However many readings there are, the estimate at a place depends on it only by how near the
tags are (`member`). On a grid that nearness is a product of one along x and one along y, so that a
field is a few products of matrices.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lupin_twin.estimate.advice import Place, best_places
from lupin_twin.estimate.cells import Cells, EstimateGrid
from lupin_twin.estimate.changed import Change, Expected, Jury, changes, expected, last_of
from lupin_twin.estimate.kernel import HOURS, Hyper, nearness, pairs_of
from lupin_twin.estimate.lattice import Lattice
from lupin_twin.estimate.member import Member
from lupin_twin.estimate.readings import Readings, Scale
from lupin_twin.grid import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Posterior:
    """The estimate as of one moment; `sd_known` is in the sensor's unit."""

    scale: Scale
    sd_known: float
    day_length_s: float
    most_probable: Hyper
    readings: Readings
    members: tuple[Member, ...]

    def points(self, xy: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean and sd (k,), in the sensor's unit, at places (k, 2), m."""
        places = _places(xy)
        return self._mixed([one.moments(self._near(one, places)) for one in self.members])

    def foretell(self, xy: FloatArray, time_s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean and sd (k,) of readings, their noise included, in the sensor's unit.

        At places (k, 2), m, and times (k,), s of ROS time, none before the newest reading. What it
        costs does not depend on how many readings there are; it takes 40 k (1 + T) bytes.

        Raises:
            ValueError: a time before the newest reading, or not finite.

        """
        places = _places(xy)
        newest_s = self.readings.time_s.max()
        later_h = (np.asarray(time_s, dtype=np.float64) - newest_s) * (HOURS / self.day_length_s)
        if not (np.isfinite(later_h) & (later_h >= 0.0)).all():
            raise ValueError(f"time_s must be finite and not before the newest reading, {newest_s}")
        return self._mixed(
            [one.moments_later(self._near(one, places), later_h) for one in self.members]
        )

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

        Fine grids of many tags are interpolated between places 0.2 m apart: the mean is off by
        0.05 sd at most, the sd by 15 %.

        Raises:
            ValueError: see `grid.grid_dimensions`.

        """
        cells = Cells.of(bbox_min_x, bbox_min_y, bbox_max_x, bbox_max_y, resolution)
        lattice = Lattice(cells.x, cells.y)
        if lattice.is_worth_it(len(self.readings.xy)):
            mean, sd = (lattice.spread(one) for one in self._on(lattice.x, lattice.y))
        else:
            mean, sd = self._on(cells.x, cells.y)
        return cells.filled(mean, sd, self.sd_known)

    def changes(self) -> tuple[Change | None, ...]:
        """For each tag, how far its last readings are off; None for a tag without any.

        By the most probable parameters.
        """
        return changes(self._jury(self.most_probable), self.readings, self.scale)

    def expected(self) -> tuple[Expected | None, ...]:
        """For each tag, what is foretold for its newest reading; None for a tag without any.

        By all readings of the other tags, and its own but for the last four, which `changes`
        judges. It costs what the posterior did.
        """
        juries = [self._jury(one.hyper) for one in self.members]
        blocks = [last_of(self.readings, tag) for tag in range(len(self.readings.xy))]
        return tuple(
            expected(juries, self.readings, block, self.scale) if len(block) else None
            for block in blocks
        )

    def advice(self, places: FloatArray, count: int, *, over: FloatArray) -> list[Place]:
        """The `count` of `places` (k, 2) where other tags help most, m; the best first.

        Each is the one where a single reading now, with those at the places before it, leaves the
        least error: the root of the mean variance at `over` (m, 2), m. It takes 8 k (k + m) bytes a
        set of parameters.

        Raises:
            ValueError: `over` is empty.

        """
        tags = self.readings.xy
        return best_places(self.members, tags, _places(places), _places(over), count)

    def _near(self, member: Member, places: FloatArray) -> FloatArray:
        return member.near(places, self.readings.xy)

    def _jury(self, h: Hyper) -> Jury:
        pairs = pairs_of(self.readings, self.day_length_s)
        return Jury(h, pairs, self.scale.standardised(self.readings.value))

    def _on(self, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean and sd (len(y), len(x)) on a grid."""
        tag_x, tag_y = self.readings.xy.T
        first, second = np.triu_indices(len(tag_x))
        twice = np.where(first == second, 1.0, 2.0)
        moments = []
        for member in self.members:
            along_x = nearness(x, tag_x, member.hyper.l)
            along_y = nearness(y, tag_y, member.hyper.l)
            w, q = member.mean_of, member.known_of
            mean = (along_y * w[1:]) @ along_x.T + w[0]
            known = (along_y * (2.0 * q[0, 1:])) @ along_x.T + q[0, 0]
            of_pairs = q[1 + first, 1 + second] * twice
            known += (along_y[:, first] * along_y[:, second] * of_pairs) @ (
                along_x[:, first] * along_x[:, second]
            ).T
            moments.append((mean, member.hyper.prior_variance - known))
        return self._mixed(moments)

    def _mixed(self, moments: list[tuple[FloatArray, FloatArray]]) -> tuple[FloatArray, FloatArray]:
        """The mean and sd of the mixture of all members, in the sensor's unit."""
        mean = np.mean([one for one, _ in moments], axis=0)
        variance = np.mean(
            [(one - mean) ** 2 + np.maximum(var, 0.0) for one, var in moments], axis=0
        )
        scale = self.scale
        return mean * scale.spread + scale.centre, np.sqrt(variance) * scale.spread


def _places(xy: FloatArray) -> FloatArray:
    """(k, 2)."""
    return np.asarray(xy, dtype=np.float64).reshape(-1, 2)
