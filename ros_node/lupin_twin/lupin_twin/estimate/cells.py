"""An estimate on the cells of a grid, and the coarse lattice that it is computed on. Pure.

The estimate is smooth, so it is computed at few places and interpolated between them by cubics
(Keys, "Cubic convolution interpolation for digital image processing", 1981), along each axis.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from lupin_twin.grid import BoolArray, FloatArray, cell_centres, grid_dimensions

# Places of the lattice, as a share of the length over which the truth changes.
_STEP: Final = 0.1
_COARSEST_STEP: Final = 0.2
# So many places are cheap; a lattice of more is as coarse as it may be.
_CHEAP: Final = 4_096
# Cells along an axis that are interpolated at a time.
_AT_ONCE: Final = 128


@dataclass(frozen=True, slots=True, eq=False)
class EstimateGrid:
    """An estimate on the cells of `lupin_twin.grid`; arrays are (height, width), row 0 at min y.

    `mean` and `sd` are in the sensor's unit, everywhere finite; `known` is where `sd` is below
    `sd_known`.
    """

    width: int
    height: int
    origin_x: float
    origin_y: float
    resolution: float
    mean: npt.NDArray[np.float32]
    sd: npt.NDArray[np.float32]
    known: BoolArray
    sd_known: float


@dataclass(frozen=True, slots=True, eq=False)
class Cells:
    """The cells of a grid: centres `x` and `y`, lower corner, size; m."""

    x: FloatArray
    y: FloatArray
    origin_x: float
    origin_y: float
    resolution: float

    @classmethod
    def of(cls, min_x: float, min_y: float, max_x: float, max_y: float, resolution: float) -> Cells:
        """Of a box, m.

        Raises:
            ValueError: see `grid.grid_dimensions`.

        """
        width, height = grid_dimensions(min_x, min_y, max_x, max_y, resolution)
        return cls(
            cell_centres(min_x, width, resolution),
            cell_centres(min_y, height, resolution),
            float(min_x),
            float(min_y),
            float(resolution),
        )

    def lattice(self, length: float) -> tuple[FloatArray, FloatArray]:
        """Where along x and y, m, to compute what changes over `length`, m.

        The cells themselves, or fewer places around them, a tenth to a fifth of the length apart.
        """
        extent = self.resolution**2 * len(self.x) * len(self.y)
        step = length * _STEP
        step = min(max(step, (extent / _CHEAP) ** 0.5), length * _COARSEST_STEP)
        if step < 2.0 * self.resolution:
            return self.x, self.y
        return _places(self.x, step), _places(self.y, step)

    def spread(self, x: FloatArray, y: FloatArray, values: FloatArray) -> FloatArray:
        """Values (len(y), len(x)) on the lattice, at the cells; none below the least."""
        if x is self.x and y is self.y:
            return values
        down = np.empty((len(self.y), len(x)))
        for cells, places, shares in _shares(self.y, y):
            np.matmul(shares, values[places], out=down[cells])
        result = np.empty((len(self.y), len(self.x)))
        for cells, places, shares in _shares(self.x, x):
            result[:, cells] = down[:, places] @ shares.T
        np.maximum(result, values.min(), out=result)
        return result

    def filled(self, mean: FloatArray, sd: FloatArray, sd_known: float) -> EstimateGrid:
        """With mean and sd (len(y), len(x)), in the sensor's unit."""
        sd_32 = sd.astype(np.float32)
        return EstimateGrid(
            width=len(self.x),
            height=len(self.y),
            origin_x=self.origin_x,
            origin_y=self.origin_y,
            resolution=self.resolution,
            mean=mean.astype(np.float32),
            sd=sd_32,
            known=sd_32 < sd_known,
            sd_known=sd_known,
        )


def _places(cells: FloatArray, step: float) -> FloatArray:
    """From one step before the first cell to two after the last."""
    count = int(np.ceil((cells[-1] - cells[0]) / step)) + 4
    result: FloatArray = cells[0] + (np.arange(count) - 1.0) * step
    return result


def _shares(cells: FloatArray, places: FloatArray) -> list[tuple[slice, slice, FloatArray]]:
    """Some cells along an axis, the places they lie between, and each place's share in each."""
    position = (cells - places[0]) / (places[1] - places[0])
    # The first cell lies on a place, and by what floats hold perhaps a little before it.
    before = np.clip(position.astype(np.int64), 1, len(places) - 3)
    t = position - before
    shares = (
        -0.5 * t**3 + t**2 - 0.5 * t,
        1.5 * t**3 - 2.5 * t**2 + 1.0,
        -1.5 * t**3 + 2.0 * t**2 + 0.5 * t,
        0.5 * t**3 - 0.5 * t**2,
    )
    result = []
    for first in range(0, len(cells), _AT_ONCE):
        some = slice(first, min(first + _AT_ONCE, len(cells)))
        lowest = int(before[first]) - 1
        part = np.zeros((some.stop - first, int(before[some.stop - 1]) + 3 - lowest))
        rows = np.arange(len(part))
        for offset, share in enumerate(shares):
            part[rows, before[some] - 1 - lowest + offset] += share[some]
        result.append((some, slice(lowest, lowest + part.shape[1]), part))
    return result
