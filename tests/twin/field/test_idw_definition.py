"""The field against its definition, the oracle's double loop."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lupin_twin.field import idw
from lupin_twin.field.idw import compute_idw_field
from tests.oracle_idw import field_by_loop
from tests.twin.field.test_idw import Sample


def assert_same_values(
    actual: npt.NDArray[np.float32], expected: Sequence[float], samples: Sequence[Sample]
) -> None:
    """The same NaN cells to the bit, and the same values to float32 rounding."""
    wanted = np.array(expected, dtype=np.float64)
    np.testing.assert_array_equal(np.isnan(actual), np.isnan(wanted))
    known = ~np.isnan(wanted)
    # Values of both signs cancel: the rest is only as exact as the largest of them.
    largest = max((abs(value) for _, _, value in samples), default=0.0)
    rounding = np.spacing(np.abs(wanted[known]).astype(np.float32)) + 1e-11 * largest
    assert (np.abs(actual[known] - wanted[known]) <= rounding).all()


@dataclass(frozen=True)
class Case:
    """A field to be computed twice."""

    samples: tuple[Sample, ...]
    width: int
    height: int
    # The arguments of both, without a size.
    rules: dict[str, Any]
    explored: npt.NDArray[np.bool_] | None = None

    def compare(self) -> None:
        low_x, low_y, cell = (self.rules[it] for it in ("bbox_min_x", "bbox_min_y", "resolution"))
        high_x, high_y = low_x + self.width * cell, low_y + self.height * cell
        grid = compute_idw_field(
            self.samples,
            bbox_max_x=high_x,
            bbox_max_y=high_y,
            explored_mask=self.explored,
            **self.rules,
        )
        assert (grid.width, grid.height) == (self.width, self.height)
        explored = None if self.explored is None else self.explored.tolist()
        by_loop = field_by_loop(
            self.samples, width=self.width, height=self.height, explored=explored, **self.rules
        )
        assert_same_values(grid.values, by_loop, self.samples)


def positions(cells: int) -> st.SearchStrategy[float]:
    """Along one axis, in cells: often on a centre or a corner, where distances tie, often not."""
    exact = st.integers(-6, 2 * cells + 6).map(lambda halves: halves / 2)
    anywhere = st.floats(-3.0, cells + 3.0)
    return st.one_of(exact, anywhere, exact.map(lambda position: position + 1e-4))


# In cells; 2.5 and 5 are hypotenuses of right triangles with legs on the grid.
RADII = st.one_of(st.sampled_from([0.0, 0.5, 1.0, 1.5, 2.5, 5.0, 100.0]), st.floats(0.0, 6.0))
VALUES = st.one_of(st.integers(-5, 40).map(float), st.floats(-1e6, 1e6))


@st.composite
def cases(draw: st.DrawFn) -> Case:
    width, height = draw(st.integers(1, 9)), draw(st.integers(1, 9))
    resolution = draw(st.sampled_from([0.001, 0.05, 0.1, 0.25, 1.0, 10.0]))
    min_x = draw(st.sampled_from([0.0, -3.7, 1000.25, -1e6]))
    min_y = draw(st.sampled_from([0.0, 12.3, -1000.25, 1e6]))
    spots = draw(st.lists(st.tuples(positions(width), positions(height), VALUES), max_size=12))
    again = draw(st.booleans())
    if spots and again:  # a second tag at the same position
        x, y, _ = draw(st.sampled_from(spots))
        spots.append((x, y, draw(VALUES)))
    falloff = draw(RADII)
    explored = None
    if draw(st.integers(0, 3)) == 0:
        cells = st.lists(st.booleans(), min_size=width * height, max_size=width * height)
        explored = np.array(draw(cells), dtype=np.bool_).reshape(height, width)
    rules = {
        "bbox_min_x": min_x,
        "bbox_min_y": min_y,
        "resolution": resolution,
        "falloff_radius_m": falloff * resolution,
        "max_distance_m": draw(st.one_of(st.just(falloff), RADII)) * resolution,
        "power": draw(st.sampled_from([2.0, 2.0, 2.0, 0.0, 0.5, 1.0, 3.0, 4.5, 60.0])),
    }
    samples = tuple((min_x + x * resolution, min_y + y * resolution, v) for x, y, v in spots)
    return Case(samples, width, height, rules, explored)


@settings(max_examples=400)
@given(cases(), st.booleans())
def test_the_field_matches_its_definition_however_it_is_split(case: Case, is_split: bool) -> None:
    with pytest.MonkeyPatch.context() as patch:
        if is_split:  # even a tiny grid, down to single cells
            patch.setattr(idw, "MAX_PAIRS", 12)
            patch.setattr(idw, "MIN_POINTS", 1)
        case.compare()


@pytest.mark.parametrize("resolution", [0.001, 10.0])
@pytest.mark.parametrize(("falloff", "max_distance"), [(1.5, 1.5), (0.7, 1.5), (2.5, 1.5)])
def test_a_field_of_many_parts_matches_its_definition(
    resolution: float, falloff: float, max_distance: float
) -> None:
    """Large enough to be split by the engine's own limit, with a hundred tags in one cell."""
    rng = np.random.default_rng(7)
    spots = np.vstack([rng.uniform(-2, 70, (60, 2)), rng.uniform(10.0, 11.0, (100, 2))])
    samples = tuple((x * resolution, y * resolution, 20 + x / 7) for x, y in spots.tolist())
    rules = {
        "bbox_min_x": 0.0,
        "bbox_min_y": 0.0,
        "resolution": resolution,
        "falloff_radius_m": falloff * 4 * resolution,
        "max_distance_m": max_distance * 4 * resolution,
        "power": 2.0,
    }
    Case(samples, 64, 48, rules).compare()
