"""The estimate as of a moment: its mean and its error anywhere, and what it makes of each tag.

Pure. Up to `MAX_EXACT` readings are solved at once; of more, each place's neighbours are.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from lupin_twin.estimate.advice import Gain, Place, best_places
from lupin_twin.estimate.cells import Cells, EstimateGrid
from lupin_twin.estimate.kernel import Hyper
from lupin_twin.estimate.left_out import Change, LeftOut, gap_of
from lupin_twin.estimate.neighbours import MAX_EXACT, Neighbours, shared_out
from lupin_twin.estimate.readings import IntArray, Readings, Scale
from lupin_twin.estimate.solved import Factor, Solved
from lupin_twin.grid import FloatArray
from lupin_twin.idw import Abandoned, never

# The most probable parameters do not know how little they know: sds are so much wider. Chosen on
# `tests/bench/other_worlds.CHOOSING`.
INFLATION: Final = 1.3
# Numbers in an array of places and tags at a time.
_AT_ONCE: Final = 4_000_000
# Of fewer other tags nothing can be said of a tag that is left out.
_LEAST_OTHERS: Final = 4


@dataclass(frozen=True, eq=False)
class Posterior:
    """The estimate as of `at_s` (ROS time, s); `sd_known` is in the sensor's unit.

    `should_stop` is asked every few milliseconds; whoever asks for something gets an `Abandoned`
    when it says so.
    """

    scale: Scale
    hyper: Hyper
    sd_known: float
    day_length_s: float
    readings: Readings
    at_s: float
    should_stop: Callable[[], bool] = never

    def points(self, xy: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean and sd (k,), in the sensor's unit, at places (k, 2), m."""
        places = np.asarray(xy, dtype=np.float64).reshape(-1, 2)
        mean, variance = np.empty(len(places)), np.empty(len(places))
        for solved, rows in self._around(places):
            for some in _split(rows, len(solved.xy)):
                self._go_on()
                mean[some], variance[some] = solved.moments(solved.near(places[some]))
        return self._in_unit(mean, variance)

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

        Fine grids are interpolated between places that are no farther apart than a fifth of the
        length over which the truth changes.

        Raises:
            ValueError: see `grid.grid_dimensions`.

        """
        cells = Cells.of(bbox_min_x, bbox_min_y, bbox_max_x, bbox_max_y, resolution)
        x, y = cells.lattice(self.hyper.l)
        if self._is_exact:
            solved, parts = self._whole, []
            for rows in _split(np.arange(len(y)), len(x) * len(solved.xy)):
                self._go_on()
                parts.append(solved.moments(solved.near_grid(x, y[rows])))
            mean, variance = (np.concatenate(one) for one in zip(*parts, strict=True))
            mean, sd = self._in_unit(mean, variance)
        else:
            mean, sd = self.points(np.stack(np.meshgrid(x, y), axis=-1))
        self._go_on()
        mean, sd = (cells.spread(x, y, one.reshape(len(y), len(x))) for one in (mean, sd))
        return cells.filled(mean, sd, self.sd_known)

    def changes(self) -> tuple[Change | None, ...]:
        """For each tag, how far its last readings are off; None for a tag without any."""
        result: list[Change | None] = [None] * len(self.readings.xy)
        of, spread = self._present, self.scale.spread
        for left_out, tags, judged in self._left_out():
            found = left_out.changed()
            for row in judged.tolist():
                z, offset, since_s = found[row]
                off = left_out.last(row, since_s)
                newest = of.value[of.tag == tags[row]][-1]
                result[self._tags[tags[row]]] = Change(
                    z,
                    offset * spread,
                    float(newest - off.off * spread),
                    self._sd(off.variance),
                    since_s,
                )
        return tuple(result)

    def left_out(self, tags: IntArray) -> list[tuple[float, float, float]]:
        """Of these tags: the newest reading, and mean and sd of what was predicted for it.

        By all readings but its own and those of tags that are nearer to it than places between
        tags commonly are to theirs: so it says of these places how sure one may be. Of a tag with
        too few others nothing is said.
        """
        of, result = self._present, []
        gap = gap_of(of.xy)
        wanted = np.flatnonzero(np.isin(self._tags, tags))
        for left_out, numbers, judged in self._left_out(wanted):
            for row in judged.tolist():
                xy = of.xy[numbers]
                near = np.flatnonzero(np.hypot(*(xy - xy[row]).T) < gap)
                near = np.union1d(near, [row])
                if len(xy) - len(near) < _LEAST_OTHERS:
                    continue
                off = left_out.newest(row, without=near)
                newest = float(of.value[of.tag == numbers[row]][-1])
                predicted = newest - off.off * self.scale.spread
                result.append((newest, predicted, self._sd(off.variance)))
        return result

    def advice(self, places: FloatArray, count: int, *, over: FloatArray) -> list[Place]:
        """The `count` of `places` (k, 2) where other tags help most, m; the best first.

        Each is the one where a single reading now, with those at the places before it, leaves the
        least error: the root of the mean variance at `over` (m, 2), m. It takes 8 k (k + m) bytes.

        Raises:
            ValueError: `over` is empty.

        """
        candidates, targets = (np.asarray(one, float).reshape(-1, 2) for one in (places, over))
        if not len(targets):
            raise ValueError("there is nowhere that a tag is to help")
        gains = []
        for solved, rows in self._around(np.vstack((candidates, targets))):
            of_candidates = candidates[rows[rows < len(candidates)]]
            of_targets = targets[rows[rows >= len(candidates)] - len(candidates)]
            gains.append(Gain(solved, of_candidates, of_targets))
        return best_places(gains, count)

    @property
    def _is_exact(self) -> bool:
        return len(self.readings) <= MAX_EXACT

    @cached_property
    def _present(self) -> Readings:
        return self.readings.of_present()

    @cached_property
    def _tags(self) -> IntArray:
        return np.unique(self.readings.tag)

    @cached_property
    def _neighbours(self) -> Neighbours:
        return Neighbours(self._present)

    @cached_property
    def _whole(self) -> Solved:
        return self._factor(self._present).solved(self.hyper, self.at_s, self.day_length_s)

    def _factor(self, readings: Readings) -> Factor:
        self._go_on()
        y = self.scale.standardised(readings.value)
        return Factor.of(self.hyper, readings, y, self.day_length_s)

    def _around(self, places: FloatArray) -> Iterator[tuple[Solved, IntArray]]:
        """All rows of `places`, with what is solved of the readings that say most of them."""
        if self._is_exact:
            yield self._whole, np.arange(len(places))
            return
        for tags, rows in shared_out(self._present.xy, places):
            if len(rows):
                near, _ = self._neighbours.around(tags)
                factor = self._factor(near)
                yield factor.solved(self.hyper, self.at_s, self.day_length_s), rows

    def _left_out(
        self, wanted: IntArray | None = None
    ) -> Iterator[tuple[LeftOut, IntArray, IntArray]]:
        """Each tag that is wanted once (None: all), with what it is judged by.

        That, the tags that its rows of `xy` are, and which of these rows are to be judged.
        """
        of = self._present
        every = np.arange(len(of.xy)) if wanted is None else wanted
        if self._is_exact:
            yield LeftOut.of(self._factor(of), INFLATION), np.arange(len(of.xy)), every
            return
        for tags, _ in shared_out(of.xy, np.empty((0, 2))):
            judged = np.intersect1d(tags, every)
            if len(judged):
                near, numbers = self._neighbours.around(tags)
                rows = np.searchsorted(numbers, judged)
                yield LeftOut.of(self._factor(near), INFLATION), numbers, rows

    def _sd(self, variance: float) -> float:
        """Of a reading, in the sensor's unit: what is true is less sure, its noise as it is."""
        noise = self.hyper.noise
        true = max(variance - noise, 0.0)
        return float((INFLATION**2 * true + noise) ** 0.5 * self.scale.spread)

    def _in_unit(self, mean: FloatArray, variance: FloatArray) -> tuple[FloatArray, FloatArray]:
        scale = self.scale
        sd = np.sqrt(variance) * (INFLATION * scale.spread)
        return mean * scale.spread + scale.centre, sd

    def _go_on(self) -> None:
        if self.should_stop():
            raise Abandoned


def _split(rows: IntArray, tags: int) -> list[IntArray]:
    """Rows in parts whose products with so many tags fit into memory."""
    count = -(-len(rows) * (1 + tags) // _AT_ONCE)
    return np.array_split(rows, max(min(count, len(rows)), 1))
