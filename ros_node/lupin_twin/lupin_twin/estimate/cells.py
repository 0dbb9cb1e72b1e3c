"""An estimate on the cells of a grid. Pure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from lupin_twin.grid import BoolArray, FloatArray, cell_centres, grid_dimensions


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
    """The cells of a grid, as GetField has it: centres `x` and `y`, lower corner, size; m."""

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

    def filled(
        self,
        mean: npt.NDArray[np.floating[Any]],
        sd: npt.NDArray[np.floating[Any]],
        sd_known: float,
    ) -> EstimateGrid:
        """With mean and sd (len(y), len(x)), in the sensor's unit."""
        sd = sd.astype(np.float32, copy=False)
        return EstimateGrid(
            width=len(self.x),
            height=len(self.y),
            origin_x=self.origin_x,
            origin_y=self.origin_y,
            resolution=self.resolution,
            mean=mean.astype(np.float32, copy=False),
            sd=sd,
            known=sd < sd_known,
            sd_known=sd_known,
        )
