"""The coarse lattice under a fine grid: cubics are met exactly, and it is used where it pays."""

from __future__ import annotations

import numpy as np
import pytest

from lupin_twin.estimate.lattice import STEP_M, Lattice
from lupin_twin.grid import FloatArray, cell_centres


def test_what_is_a_parabola_along_each_axis_is_met_exactly() -> None:
    x, y = cell_centres(-1.0, 60, 0.05), cell_centres(3.0, 41, 0.05)
    lattice = Lattice(x, y)

    def shape(at_x: FloatArray, at_y: FloatArray) -> FloatArray:
        result: FloatArray = (at_x**2 - at_x + 1.0)[None, :] * (2.0 * at_y**2 + at_y)[:, None]
        return result

    assert lattice.spread(shape(lattice.x, lattice.y)) == pytest.approx(shape(x, y), rel=1e-9)


@pytest.mark.parametrize("count", [1, 2, 5, 40])
def test_every_cell_has_two_places_on_either_side(count: int) -> None:
    cells = cell_centres(0.0, count, 0.05)
    lattice = Lattice(cells, cells)
    assert lattice.x[1] == pytest.approx(cells[0])
    assert lattice.x[-2] >= cells[-1]
    assert np.diff(lattice.x) == pytest.approx(np.full(len(lattice.x) - 1, STEP_M))
    ones = lattice.spread(np.ones((len(lattice.y), len(lattice.x))))
    assert ones == pytest.approx(np.ones((count, count)))


def test_many_cells_are_interpolated_some_at_a_time_and_none_below_the_least() -> None:
    x, y = cell_centres(0.0, 300, 0.05), cell_centres(0.0, 290, 0.05)
    lattice = Lattice(x, y, 0.5)
    assert np.diff(lattice.x) == pytest.approx(np.full(len(lattice.x) - 1, 0.5))
    shape = lattice.x[None, :] * lattice.y[:, None] + 40.0
    whole = lattice.spread(shape)
    assert whole == pytest.approx(x[None, :] * y[:, None] + 40.0, rel=1e-9)
    single = lattice.spread(shape.astype(np.float32))
    assert single.dtype == np.float32
    assert single == pytest.approx(whole, rel=1e-5)
    dips = np.ones_like(shape)
    dips[5, 5] = 0.01
    assert lattice.spread(dips).min() >= 0.01


def test_it_is_worth_it_for_many_fine_cells_of_many_tags() -> None:
    fine, coarse = cell_centres(0.0, 200, 0.04), cell_centres(0.0, 200, 0.2)
    assert Lattice(fine, fine).is_worth_it(30)
    assert not Lattice(fine, fine).is_worth_it(2)
    assert not Lattice(coarse, coarse).is_worth_it(30)
    few = cell_centres(0.0, 20, 0.04)
    assert not Lattice(few, few).is_worth_it(30)


def test_wherever_the_cells_begin_the_first_lies_between_places() -> None:
    for begin in np.random.default_rng(0).uniform(-5.0, 5.0, 200):
        cells = begin + 0.01 * np.arange(40)
        lattice = Lattice(cells, cells)
        x = np.broadcast_to(lattice.x, (len(lattice.y), len(lattice.x)))
        np.testing.assert_allclose(lattice.spread(x.copy())[0], cells, atol=1e-9)
