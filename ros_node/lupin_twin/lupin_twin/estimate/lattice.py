"""A coarse lattice under a fine grid: the estimate is smooth, so it is made on few places only.

Pure. Between the places it is interpolated by cubics (Keys, "Cubic convolution interpolation for
digital image processing", 1981), along each axis by itself.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, TypeVar

import numpy as np
import numpy.typing as npt

from lupin_twin.grid import FloatArray

STEP_M: Final = 0.2
# Products of pairs of tags with cells that are done directly in about a millisecond each member.
_CHEAP: Final = 3_000_000
# Cells along an axis that are interpolated at a time.
_AT_ONCE: Final = 128

Spread = TypeVar("Spread", np.float32, np.float64)


class Lattice:
    """Places `x` (m), `y` (m), `step_m` apart, that surround the centres of a grid's cells."""

    def __init__(self, cells_x: FloatArray, cells_y: FloatArray, step_m: float = STEP_M) -> None:
        self._cells = cells_x, cells_y
        self._step_m = step_m
        self.x = _places(cells_x, step_m)
        self.y = _places(cells_y, step_m)

    @property
    def is_coarser(self) -> bool:
        """Whether it has fewer places than the grid has cells, by far."""
        return len(self.x) * len(self.y) * 4 <= len(self._cells[0]) * len(self._cells[1])

    def is_worth_it(self, tags: int) -> bool:
        """Whether the cells are many, for so many tags, and finer than the lattice."""
        cells = len(self._cells[0]) * len(self._cells[1])
        return cells * tags * tags > _CHEAP and self.is_coarser

    def spread(self, values: npt.NDArray[Spread]) -> npt.NDArray[Spread]:
        """Values (len(y), len(x)) at the lattice's places, at the cells; none below the least."""
        down = np.empty((len(self._cells[1]), len(self.x)), dtype=values.dtype)
        for cells, places, shares in self._parts(1, values.dtype):
            np.matmul(shares, values[places], out=down[cells])
        result = np.empty((len(down), len(self._cells[0])), dtype=values.dtype)
        for cells, places, shares in self._parts(0, values.dtype):
            result[:, cells] = down[:, places] @ shares.T
        np.maximum(result, values.min(), out=result)
        return result

    def _parts(
        self, axis: int, kind: np.dtype[Spread]
    ) -> Iterator[tuple[slice, slice, npt.NDArray[Spread]]]:
        """Some cells along an axis, the places they lie between, and each place's share in each."""
        cells, places = self._cells[axis], (self.x, self.y)[axis]
        position = (cells - places[0]) / self._step_m
        # The first cell lies on a place, and by what floats hold perhaps a little before it.
        before = np.clip(position.astype(np.int64), 1, len(places) - 3)
        t = position - before
        shares = (
            -0.5 * t**3 + t**2 - 0.5 * t,
            1.5 * t**3 - 2.5 * t**2 + 1.0,
            -1.5 * t**3 + 2.0 * t**2 + 0.5 * t,
            0.5 * t**3 - 0.5 * t**2,
        )
        for first in range(0, len(cells), _AT_ONCE):
            some = slice(first, min(first + _AT_ONCE, len(cells)))
            lowest = int(before[first]) - 1
            result = np.zeros((some.stop - first, int(before[some.stop - 1]) + 3 - lowest), kind)
            rows = np.arange(len(result))
            for offset, share in enumerate(shares):
                result[rows, before[some] - 1 - lowest + offset] += share[some]
            yield some, slice(lowest, lowest + result.shape[1]), result


def _places(cells: FloatArray, step_m: float) -> FloatArray:
    """From one step before the first cell to two after the last."""
    count = int(np.ceil((cells[-1] - cells[0]) / step_m)) + 4
    result: FloatArray = cells[0] + (np.arange(count) - 1.0) * step_m
    return result
