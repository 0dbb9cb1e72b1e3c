"""The grid's cells: how many, where their centres lie, and that float noise adds none."""

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from lupin_twin.field.grid import grid_dimensions


def float32(number: float) -> float:
    return float(np.float32(number))


@pytest.mark.parametrize("through", [float, float32, np.float32])
@pytest.mark.parametrize(
    ("extent", "resolution", "cells"),
    [
        (1000.0, 0.1, 10_000),
        (0.05, 0.1, 1),
        (0.0, 0.1, 1),
        (0.003, 0.001, 3),
        (70.0, 10.0, 7),
        (0.027, 0.009, 3),
        (70.1, 10.0, 8),
    ],
)
def test_dimensions_are_the_extent_in_cells_rounded_up(
    through: Any, extent: float, resolution: float, cells: int
) -> None:
    dimensions = grid_dimensions(
        through(0.0), through(-extent), through(extent), through(0.0), through(resolution)
    )
    assert dimensions == (cells, cells)
    assert [type(number) for number in dimensions] == [int, int]


@settings(max_examples=500)
@given(
    st.integers(-100_000, 100_000),
    st.integers(1, 3000),
    st.sampled_from(["0.05", "0.1", "0.2", "0.3", "0.7", "1", "2.3"]),
    st.sampled_from([float, float32]),
)
@example(10_001, 11, "0.1", float32)
def test_float_noise_never_adds_a_cell(
    tenths: int, cells: int, resolution: str, through: Any
) -> None:
    """A whole number of cells, in decimal, stays one: up to 10 km from the origin, rounded too."""
    low = Fraction(tenths, 10)
    high = low + cells * Fraction(resolution)
    bounds = [through(float(low)), through(float(high))]
    assert grid_dimensions(bounds[0], 0.0, bounds[1], 1.0, through(float(resolution)))[0] == cells


@settings(max_examples=300)
@given(
    st.integers(-1000, 1000),
    st.integers(0, 300),
    st.floats(0.05, 0.95),
    st.sampled_from([float, float32]),
)
def test_part_of_a_cell_is_a_cell(tenths: int, cells: int, part: float, through: Any) -> None:
    low = tenths / 10
    high = low + (cells + part) * 0.1
    width, _ = grid_dimensions(through(low), 0.0, through(high), 1.0, through(0.1))
    assert width == cells + 1


@pytest.mark.parametrize(
    ("extent", "resolution"), [(1000.0, 1e-9), (3.4e38, 1e-45), (1e308, 5e-324), (1.7e308, 1e-3)]
)
def test_grid_bombs_have_exact_dimensions(extent: float, resolution: float) -> None:
    dimensions = grid_dimensions(0.0, -extent, extent, extent, resolution)
    assert [type(number) for number in dimensions] == [int, int]
    cells = Fraction(extent) / Fraction(resolution)
    assert [float(number / cells) for number in dimensions] == pytest.approx([1.0, 2.0], rel=1e-9)
