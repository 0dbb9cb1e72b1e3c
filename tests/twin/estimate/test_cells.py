"""An estimate on cells: those of `lupin_twin.grid`."""

from __future__ import annotations

import numpy as np
import pytest

from lupin_twin.estimate.cells import Cells


def test_cells_are_those_of_a_field_and_known_is_below_a_limit() -> None:
    cells = Cells.of(1.0, 2.0, 2.0, 2.5, 0.5)
    assert cells.x.tolist() == [1.25, 1.75]
    assert cells.y.tolist() == [2.25]
    sd = np.array([[0.5, 0.25]])
    grid = cells.filled(np.array([[20.0, 21.0]]), sd, 0.5)
    assert (grid.width, grid.height, grid.resolution) == (2, 1, 0.5)
    assert (grid.origin_x, grid.origin_y) == (1.0, 2.0)
    assert grid.mean.dtype == grid.sd.dtype == np.float32
    assert grid.mean.tolist() == [[20.0, 21.0]]
    assert grid.known.tolist() == [[False, True]]
    assert grid.sd_known == 0.5


def test_a_box_upside_down_is_refused() -> None:
    with pytest.raises(ValueError, match="bbox"):
        Cells.of(1.0, 2.0, 0.0, 2.5, 0.5)
