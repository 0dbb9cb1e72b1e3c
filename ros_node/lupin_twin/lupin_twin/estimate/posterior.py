"""The estimate as of a moment: its mean and error at places, on grids, and for each tag.

Pure. Up to `MAX_EXACT` readings are solved at once; if there are more, those near each place are.
The estimate is smooth, so a grid is computed at few places and interpolated by cubics along each
axis (Keys, "Cubic convolution interpolation for digital image processing", 1981).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
import numpy.typing as npt

from lupin_twin.estimate.kernel import Hyper, IntArray, Readings, Scale
from lupin_twin.estimate.solution import (
    INFLATION,
    MAX_EXACT,
    Change,
    Factor,
    Gain,
    LeftOut,
    Neighbours,
    Place,
    Solved,
    best_places,
    shared_out,
)
from lupin_twin.field.grid import BoolArray, CellGrid, FloatArray, cell_centres, grid_dimensions
from lupin_twin.field.idw import Abandoned, never

# Step of the lattice, as a share of the length over which the values change.
_STEP: Final = 0.1
_COARSEST_STEP: Final = 0.2
# Places above which a lattice is made coarser, up to `_COARSEST_STEP`.
_CHEAP: Final = 4_096


@dataclass(frozen=True, slots=True, eq=False)
class EstimateGrid(CellGrid):
    """An estimate on the cells of `field.grid`; arrays are (height, width), row 0 at min y.

    `mean` and `sd` are in the sensor's unit, everywhere finite; `known` is where `sd` is below
    `sd_known`.
    """

    mean: npt.NDArray[np.float32]
    sd: npt.NDArray[np.float32]
    known: BoolArray
    sd_known: float


def lattice(
    cells: tuple[FloatArray, FloatArray], resolution: float, length: float
) -> tuple[FloatArray, FloatArray]:
    """The places along x and y, m, at which to compute values that change over `length`, m.

    They are the centres of the cells themselves, or fewer places, a tenth to a fifth of the length
    apart.
    """
    x, y = cells
    extent = resolution**2 * len(x) * len(y)
    step = min(max(length * _STEP, (extent / _CHEAP) ** 0.5), length * _COARSEST_STEP)
    return cells if step < 2.0 * resolution else (_places(x, step), _places(y, step))


def _spread(
    cells: tuple[FloatArray, FloatArray], places: tuple[FloatArray, FloatArray], values: FloatArray
) -> FloatArray:
    """Interpolate values at places, in rows of x, at the cells; none is below their least."""
    if places is cells:
        return values.reshape(len(cells[1]), -1)
    values = values.reshape(len(places[1]), -1)
    x, y = (_shares(*axis) for axis in zip(cells, places, strict=True))
    result: FloatArray = y @ values @ x.T
    np.maximum(result, values.min(), out=result)
    return result


def _places(cells: FloatArray, step: float) -> FloatArray:
    """Places from one step before the first cell to two after the last."""
    count = int(np.ceil((cells[-1] - cells[0]) / step)) + 4
    result: FloatArray = cells[0] + (np.arange(count) - 1.0) * step
    return result


def _shares(cells: FloatArray, places: FloatArray) -> FloatArray:
    """Along an axis, the interpolation weight that each place has at each cell."""
    position = (cells - places[0]) / (places[1] - places[0])
    # The first cell lies on a place or, because of rounding, slightly before it.
    before = np.clip(position.astype(np.int64), 1, len(places) - 3)
    t = position - before
    result = np.zeros((len(cells), len(places)))
    rows = np.arange(len(cells))
    result[rows, before - 1] = -0.5 * t**3 + t**2 - 0.5 * t
    result[rows, before] = 1.5 * t**3 - 2.5 * t**2 + 1.0
    result[rows, before + 1] = -1.5 * t**3 + 2.0 * t**2 + 0.5 * t
    result[rows, before + 2] = 0.5 * t**3 - 0.5 * t**2
    return result


# Numbers in an array of places by tags that is computed at once.
_AT_ONCE: Final = 4_000_000


@dataclass(frozen=True, eq=False)
class Posterior:
    """The estimate as of `at_s` (ROS time, s); `sd_known` is in the sensor's unit.

    `should_stop` is called every few milliseconds; methods raise `Abandoned` when it is true.
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
        length over which the values change.
        """
        width, height = grid_dimensions(bbox_min_x, bbox_min_y, bbox_max_x, bbox_max_y, resolution)
        cells = (
            cell_centres(bbox_min_x, width, resolution),
            cell_centres(bbox_min_y, height, resolution),
        )
        x, y = places = lattice(cells, resolution, self.hyper.l)
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
        mean_32, sd_32 = (_spread(cells, places, one).astype(np.float32) for one in (mean, sd))
        return EstimateGrid(
            width,
            height,
            float(bbox_min_x),
            float(bbox_min_y),
            float(resolution),
            mean=mean_32,
            sd=sd_32,
            known=sd_32 < self.sd_known,
            sd_known=self.sd_known,
        )

    def changes(self) -> tuple[Change | None, ...]:
        """For each tag, how far its last readings are off; None for a tag without any."""
        result: list[Change | None] = [None] * len(self.readings.xy)
        for left_out, tags, judged in self._left_out():
            found = left_out.changed()
            for row in judged.tolist():
                z, offset, since_s = found[row]
                expected, sd = self._expected_of(tags[row], *left_out.last(row, since_s))
                change = Change(z, offset * self.scale.spread, expected, sd, since_s)
                result[self._tags[tags[row]]] = change
        return tuple(result)

    def advice(self, places: FloatArray, count: int, *, over: FloatArray) -> list[Place]:
        """Choose `count` of `places` (k, 2), m, where another tag helps most; the best first.

        A single reading at each place, added to those before it, leaves the least error. The error
        is the root of the mean variance at `over` (m, 2), m. It takes 8 k (k + m) bytes.
        """
        candidates, targets = (np.asarray(one, float).reshape(-1, 2) for one in (places, over))
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
        """Yield all rows of `places` in groups, each with the solution from the readings near."""
        if self._is_exact:
            yield self._whole, np.arange(len(places))
            return
        for tags, rows in shared_out(self._present.xy, places):
            if len(rows):
                near, _ = self._neighbours.around(tags)
                factor = self._factor(near)
                yield factor.solved(self.hyper, self.at_s, self.day_length_s), rows

    def _left_out(self) -> Iterator[tuple[LeftOut, IntArray, IntArray]]:
        """Yield all tags in groups, each tag once.

        A group is its predictor, the tags that its rows of `xy` are, and the rows to be judged.
        """
        of = self._present
        if self._is_exact:
            every = np.arange(len(of.xy))
            yield LeftOut.of(self._factor(of)), every, every
            return
        for tags, _ in shared_out(of.xy, np.empty((0, 2))):
            near, numbers = self._neighbours.around(tags)
            rows = np.searchsorted(numbers, np.sort(tags))
            yield LeftOut.of(self._factor(near)), numbers, rows

    def _expected_of(self, tag: int, off: float, variance: float) -> tuple[float, float]:
        """The mean and sd predicted for a tag's latest reading from the others.

        The inflation applies to the true value, not to the noise of a reading.
        """
        newest = float(self._present.value[self._present.tag == tag][-1])
        noise, spread = self.hyper.noise, self.scale.spread
        true = max(variance - noise, 0.0)
        return newest - off * spread, (INFLATION**2 * true + noise) ** 0.5 * spread

    def _in_unit(self, mean: FloatArray, variance: FloatArray) -> tuple[FloatArray, FloatArray]:
        scale = self.scale
        sd = np.sqrt(variance) * (INFLATION * scale.spread)
        return mean * scale.spread + scale.centre, sd

    def _go_on(self) -> None:
        if self.should_stop():
            raise Abandoned


def _split(rows: IntArray, tags: int) -> list[IntArray]:
    """Split rows into parts whose products with this many tags fit into memory."""
    count = -(-len(rows) * (1 + tags) // _AT_ONCE)
    return np.array_split(rows, max(min(count, len(rows)), 1))
