"""Field reconstruction: inverse distance weighting of the tags' readings onto a regular grid.

Pure: numpy and the standard library only, no ROS, no clock, no state; any thread may call it.

Positions, distances and the resolution are metres in the map frame, values are in the sensor's
own unit. Cell `(i, j)` is column `i` (along x) and row `j` (along y), its centre lies at
`bbox_min + (index + 0.5) * resolution`. Row 0 is at `bbox_min_y`; `values` is row-major. NaN is
"unknown" and never a reading.

The definition (Shepard, "A two-dimensional interpolation function for irregularly-spaced data",
1968, with a gate and a radius), per cell and in this order:

1. unexplored (mask given and false): NaN;
2. nearest sample farther than `max_distance_m`: NaN, the honesty gate;
3. nearest sample closer than `COINCIDENT_EPS_M`: exactly its value;
4. samples within `falloff_radius_m`: sum(v / d**p) / sum(1 / d**p);
5. none within: the nearest sample's value.

A distance is the float64 `sqrt(dx * dx + dy * dy)`; of equally near samples the first one counts.

The algorithm halves the grid recursively, and gives each part only the samples that reach it. When
the pairs of cells and samples of a part fit into the processor's cache, they are evaluated at once.
A part that no sample reaches is dropped. So the cost is proportional to the painted cells, and
memory beyond the grid's own is that of one part.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator, Sequence
from itertools import chain
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from lupin_twin.field.grid import (
    BoolArray,
    FieldGrid,
    FloatArray,
    cell_centres,
    check_finite,
    grid_dimensions,
)

COINCIDENT_EPS_M: Final = 1e-3

# Pairs of a part that are evaluated at once. Two float64 arrays of this size stay in the
# second-level cache, and numpy's work on them is several times the cost of calling it.
MAX_PAIRS: Final = 65_536
# With fewer points than this per sample, numpy's loops are mostly overhead. It takes memory past
# MAX_PAIRS only if more than two thousand samples reach one part.
MIN_POINTS: Final = 32

# Up to this radius, weights are plain 1/d². Beyond it, and for any power but 2, they are scaled by
# the nearest distance of the cell, so that none overflows and the largest is exactly 1.
_MAX_PLAIN_REACH_M: Final = 1e6

# Larger readings are clipped to this: it is far past float32, and Σ(v/dᵖ) cannot overflow.
_LARGEST_VALUE: Final = 1e280

# Least weight, at power 2, of a sample closer than COINCIDENT_EPS_M; 0.999 allows for rounding.
_COINCIDENT_WEIGHT: Final = 0.999 / COINCIDENT_EPS_M**2

IndexArray = npt.NDArray[np.intp]


def _largest_square_within(radius: float) -> float:
    """The largest float64 whose square root is not greater than `radius`.

    So `sqrt(square) <= radius` and `square <= _largest_square_within(radius)` are equivalent, to
    the bit, and the root need not be taken for every pair.
    """
    square = min(radius * radius, sys.float_info.max)
    while math.sqrt(following := math.nextafter(square, math.inf)) <= radius:
        square = following
    return square


# The largest squared distance that is closer than COINCIDENT_EPS_M, which itself is not.
_COINCIDENT_SQUARE: Final = _largest_square_within(math.nextafter(COINCIDENT_EPS_M, 0.0))


class Abandoned(Exception):
    """The computation was stopped early, because nobody waits for its result any more."""


def never() -> bool:
    """The `should_stop` of a computation that is never stopped."""
    return False


class FieldSample(NamedTuple):
    """One reading at its place: x and y in metres (map frame), the value in the sensor's unit."""

    x: float
    y: float
    value: float


def compute_idw_field(
    samples: Sequence[tuple[float, float, float]],
    *,
    bbox_min_x: float,
    bbox_min_y: float,
    bbox_max_x: float,
    bbox_max_y: float,
    resolution: float,
    falloff_radius_m: float,
    max_distance_m: float,
    power: float,
    explored_mask: BoolArray | None = None,
    should_stop: Callable[[], bool] = never,
) -> FieldGrid:
    """Compute the field of `samples` over the box, by the module's definition.

    `samples` are (x, y, value) in the order they were recorded; `FieldSample` is one. Without
    samples all cells are NaN, which is no error. `explored_mask` has the grid's shape,
    (height, width). `should_stop()` is called every millisecond or so.

    Raises:
        ValueError: an argument is out of its range; the message names its value and the limit.
        Abandoned: `should_stop` was true.

    """
    width, height = grid_dimensions(bbox_min_x, bbox_min_y, bbox_max_x, bbox_max_y, resolution)
    if explored_mask is not None and (
        explored_mask.shape != (height, width) or explored_mask.dtype != np.bool_
    ):
        raise ValueError(
            f"explored_mask is {explored_mask.dtype} of shape {explored_mask.shape}, must be bool "
            f"of shape {(height, width)} (height, width)"
        )
    x, y, value = sample_columns(samples)
    idw = PairwiseIdw(falloff_radius_m=falloff_radius_m, max_distance_m=max_distance_m, power=power)
    cell_x = cell_centres(bbox_min_x, width, resolution)
    cell_y = cell_centres(bbox_min_y, height, resolution)
    values = np.full((height, width), np.nan, dtype=np.float32)
    with np.errstate(all="ignore"):
        for rows, columns, near in _parts((x, y), (cell_x, cell_y), idw, explored_mask):
            if should_stop():
                raise Abandoned
            dx = np.square(x[near][:, None] - cell_x[columns])
            dy = np.square(y[near][:, None] - cell_y[rows])
            shape = dy.shape[1], dx.shape[1]
            square = idw.squares(near.size, shape[0] * shape[1])
            np.add(dy[:, :, None], dx[:, None, :], out=square.reshape(-1, *shape))
            values[rows, columns] = idw.evaluate(square, value[near]).reshape(shape)
        if explored_mask is not None:
            values[~explored_mask] = np.nan
        value_min, value_max = _finite_range(values)
    values.setflags(write=False)
    return FieldGrid(
        width=width,
        height=height,
        origin_x=float(bbox_min_x),
        origin_y=float(bbox_min_y),
        resolution=float(resolution),
        values=values.reshape(-1),
        value_min=value_min,
        value_max=value_max,
        sample_count=len(samples),
    )


def sample_columns(
    samples: Sequence[tuple[float, float, float]],
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The samples' x and y (m) and values, as arrays; values are clipped to `_LARGEST_VALUE`.

    Raises:
        ValueError: a sample is not three finite numbers.

    """
    flat = np.fromiter(chain.from_iterable(samples), dtype=np.float64)
    if flat.size != 3 * len(samples):
        raise ValueError(f"samples hold {flat.size} numbers, must be 3 each of {len(samples)}")
    finite = np.isfinite(flat)
    if not finite.all():
        index = int(np.argmin(finite))
        raise ValueError(
            f"samples[{index // 3}].{FieldSample._fields[index % 3]} is {flat[index]}, "
            "must be finite"
        )
    x, y, value = np.ascontiguousarray(flat.reshape(-1, 3).T)
    return x, y, np.clip(value, -_LARGEST_VALUE, _LARGEST_VALUE)


def _finite_range(values: npt.NDArray[np.float32]) -> tuple[float, float]:
    finite = values[np.isfinite(values)]
    return (float(finite.min()), float(finite.max())) if finite.size else (0.0, 0.0)


class PairwiseIdw:
    """Evaluates rules 2 to 5 of the definition at any points, from squared distances to samples.

    Not to be shared between threads: the intermediate arrays are reused by the next evaluation.

    Raises:
        ValueError: a rule is out of its range; the message names it, its value and the limit.

    """

    def __init__(self, *, falloff_radius_m: float, max_distance_m: float, power: float) -> None:
        for name, number in (
            ("falloff_radius_m", falloff_radius_m),
            ("max_distance_m", max_distance_m),
            ("power", power),
        ):
            check_finite(name, number)
            if number < 0.0:
                raise ValueError(f"{name} is {number}, must not be less than 0")
        self.power = power
        self.falloff_radius = falloff_radius_m
        self.max_distance = max_distance_m
        self.falloff_square = _largest_square_within(falloff_radius_m)
        self.max_square = _largest_square_within(max_distance_m)
        self.reach_square = max(self.falloff_square, self.max_square)
        self._equal_radii = falloff_radius_m == max_distance_m
        self._plain_weights = power == 2.0 and falloff_radius_m <= _MAX_PLAIN_REACH_M
        self._allocate(MAX_PAIRS)

    def _allocate(self, pairs: int) -> None:
        # In one block: the allocator reuses it for the next field instead of returning it to the
        # system. That avoids page faults, a fifth of a small field's time.
        self._square, self._weight = np.empty((2, pairs))
        self._within = np.empty(pairs, dtype=np.bool_)

    def squares(self, samples: int, points: int) -> FloatArray:
        """An array (samples, points) to fill with squared distances (m²), for `evaluate`."""
        pairs = samples * points
        if pairs > self._square.size:
            self._allocate(pairs)
        return self._square[:pairs].reshape(samples, points)

    def evaluate(self, square: FloatArray, value: FloatArray) -> FloatArray:
        """The points' values, NaN past `max_distance_m`; `square`, from `squares`, is overwritten.

        An infinite squared distance excludes a sample from a point. Call it with numpy's
        floating-point warnings off: 0/0 is a point that no sample reaches, 1/0 a sample on a point.
        """
        weight = self._weight[: square.size].reshape(square.shape)
        within = self._within[: square.size].reshape(square.shape)
        np.less_equal(square, self.falloff_square, out=within)
        weight.fill(0.0)
        if self._plain_weights:
            return self._evaluate_plain(square, value, weight, within)
        return self._evaluate_normalised(square, value, weight, within)

    def _evaluate_plain(
        self, square: FloatArray, value: FloatArray, weight: FloatArray, within: BoolArray
    ) -> FloatArray:
        """Power 2: 1/d² needs no root, and the nearest sample is seldom needed."""
        np.divide(1.0, square, out=weight, where=within)
        total = np.ones(value.size).dot(weight)
        points: FloatArray = value.dot(weight)
        points /= total
        # With equal radii, a point out of reach is 0/0 by now. The nearest sample matters only if
        # the weights are so large that one may be coincident.
        if self._equal_radii and np.maximum.reduce(total) < _COINCIDENT_WEIGHT:
            return points
        shortest = np.minimum.reduce(square, axis=0)
        special = np.flatnonzero((shortest <= _COINCIDENT_SQUARE) | (total == 0.0))
        if special.size:
            # By the root: squares that differ by rounding can be the same distance, and of equally
            # near samples the first one counts.
            distance = square[:, special]
            np.sqrt(distance, out=distance)
            points[special] = value[distance.argmin(axis=0)]
        points[shortest > self.max_square] = np.nan
        return points

    def _evaluate_normalised(
        self, square: FloatArray, value: FloatArray, weight: FloatArray, within: BoolArray
    ) -> FloatArray:
        """Any power: the weights are (nearest/d)ᵖ, so that the largest is 1 and none overflows."""
        distance = np.sqrt(square, out=square)
        shortest = np.minimum.reduce(distance, axis=0)
        np.divide(shortest, distance, out=weight, where=within)
        np.power(weight, self.power, out=weight, where=within)
        points: FloatArray = value.dot(weight)
        points /= np.ones(value.size).dot(weight)
        special = np.flatnonzero((shortest < COINCIDENT_EPS_M) | (shortest > self.falloff_radius))
        if special.size:
            points[special] = value[distance[:, special].argmin(axis=0)]
        points[shortest > self.max_distance] = np.nan
        return points


def fits(samples: int, points: int) -> bool:
    """Whether this many samples and points are better evaluated at once than in parts."""
    return samples * points <= MAX_PAIRS or points <= MIN_POINTS


def _parts(
    samples: tuple[FloatArray, FloatArray],
    cells: tuple[FloatArray, FloatArray],
    idw: PairwiseIdw,
    explored: BoolArray | None,
) -> Iterator[tuple[slice, slice, IndexArray]]:
    """Yield the rows, columns and near samples of each part, except parts that stay NaN.

    A part has the samples that reach the nearest point of its cells. Rounding is monotonic, so no
    cell's own squared distance is below that point's, and no sample is lost to float noise.
    """
    (x, y), (cell_x, cell_y) = samples, cells
    whole = slice(0, cell_y.size), slice(0, cell_x.size), np.arange(x.size)
    parts = [whole] if x.size else []
    while parts:
        rows, columns, near = parts.pop()
        if explored is not None and not explored[rows, columns].any():
            continue
        gap = gap_squares(x[near], cell_x[columns]) + gap_squares(y[near], cell_y[rows])
        if gap.min() > idw.max_square:
            continue
        near = near[gap <= idw.reach_square]
        down, across = rows.stop - rows.start, columns.stop - columns.start
        if fits(near.size, down * across):
            yield rows, columns, near
        elif down > across:
            middle = rows.start + down // 2
            halves = slice(rows.start, middle), slice(middle, rows.stop)
            parts += [(half, columns, near) for half in halves]
        else:
            middle = columns.start + across // 2
            halves = slice(columns.start, middle), slice(middle, columns.stop)
            parts += [(rows, half, near) for half in halves]


def gap_squares(position: FloatArray, part: FloatArray) -> FloatArray:
    """Squared distance (m²) along one axis from each position to the extent of `part`."""
    gap: FloatArray = np.clip(position, part.min(), part.max()) - position
    return np.square(gap, out=gap)
