"""Fields as points: each known cell once, with its position and its error."""

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst

from lupin_twin.estimate.posterior import EstimateGrid
from lupin_twin.field.grid import FieldGrid
from lupin_twin.ros.layers import ERROR_UNKNOWN, points

SIDES = st.integers(1, 6)
CELLS = st.one_of(st.just(math.nan), st.just(math.inf), st.floats(-1e6, 1e6, width=32))


def field(values: np.ndarray[tuple[int, int], np.dtype[np.float32]]) -> FieldGrid:
    height, width = values.shape
    return FieldGrid(width, height, -1.5, 2.25, 0.5, values.reshape(-1), 0.0, 0.0, 1)


@given(st.data(), SIDES, SIDES)
def test_the_points_are_those_of_a_plain_loop(data: st.DataObject, width: int, height: int) -> None:
    grid = field(data.draw(npst.arrays(np.float32, (height, width), elements=CELLS)))
    numbers = npst.arrays(np.float32, (height, width), elements=st.floats(0, 1e3, width=32))
    mean, sd = data.draw(numbers), data.draw(numbers)
    known = np.ones((height, width), dtype=np.bool_)
    estimate = EstimateGrid(width, height, -1.5, 2.25, 0.5, mean, sd, known, 1.0)
    expected = []
    for row in range(height):
        for column in range(width):
            value = float(grid.values[row * width + column])
            if math.isfinite(value):
                x, y = -1.5 + (column + 0.5) * 0.5, 2.25 + (row + 0.5) * 0.5
                error = math.hypot(float(sd[row, column]), value - float(mean[row, column]))
                expected.append((x, y, 0.0, value, error))
    found = points(grid, estimate)
    assert found.dtype == np.dtype(np.float32)
    assert found.shape == (len(expected), 5)
    # Below the smallest normal number, float32 has fewer digits.
    least = float(np.finfo(np.float32).smallest_normal)
    np.testing.assert_allclose(found, np.array(expected).reshape(-1, 5), rtol=1e-5, atol=least)
    bare = points(grid, None)
    np.testing.assert_array_equal(bare[:, :4], found[:, :4])
    assert (bare[:, 4] == ERROR_UNKNOWN).all()
