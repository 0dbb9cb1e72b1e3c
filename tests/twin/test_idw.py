"""The field against its definition: the oracle's double loop, rule by rule, and at the extremes."""

from __future__ import annotations

import math
import tracemalloc
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lupin_twin import idw
from lupin_twin.grid import FieldGrid, cell_centres
from lupin_twin.idw import COINCIDENT_EPS_M, FieldSample, compute_idw_field
from tests.oracle_idw import field_by_loop

Sample = tuple[float, float, float]

# One cell whose centre is exactly the origin.
UNIT_CELL: dict[str, Any] = {
    "bbox_min_x": -0.5,
    "bbox_min_y": -0.5,
    "bbox_max_x": 0.5,
    "bbox_max_y": 0.5,
    "resolution": 1.0,
}


def field_at_origin(samples: Sequence[Sample], **rules: Any) -> float:
    """The one value of a field of one cell, centred on the origin."""
    defaults = {"falloff_radius_m": 1.5, "max_distance_m": 1.5, "power": 2.0}
    grid = compute_idw_field(samples, **UNIT_CELL, **{**defaults, **rules})
    assert grid.values.shape == (1,)
    return float(grid.values[0])


def field_over(width: int, height: int, samples: Sequence[Sample], **changes: Any) -> FieldGrid:
    """A field over `width` x `height` cells from the origin, 1 m each unless changed."""
    resolution = changes.pop("resolution", 1.0)
    defaults = {"falloff_radius_m": 1.5, "max_distance_m": 1.5, "power": 2.0}
    return compute_idw_field(
        samples,
        bbox_min_x=0.0,
        bbox_min_y=0.0,
        bbox_max_x=width * resolution,
        bbox_max_y=height * resolution,
        resolution=resolution,
        **{**defaults, **changes},
    )


def assert_same_values(
    actual: npt.NDArray[np.float32], expected: Sequence[float], samples: Sequence[Sample]
) -> None:
    """The same NaN cells to the bit, and the same values to float32 rounding."""
    wanted = np.array(expected, dtype=np.float64)
    np.testing.assert_array_equal(np.isnan(actual), np.isnan(wanted))
    known = ~np.isnan(wanted)
    # Values of both signs cancel: what is left is as exact as the largest of them.
    largest = max((abs(value) for _, _, value in samples), default=0.0)
    rounding = np.spacing(np.abs(wanted[known]).astype(np.float32)) + 1e-11 * largest
    assert (np.abs(actual[known] - wanted[known]) <= rounding).all()


# --- against the oracle ----------------------------------------------------------------------


@dataclass(frozen=True)
class Case:
    """A field to be made twice."""

    samples: tuple[Sample, ...]
    width: int
    height: int
    min_x: float
    min_y: float
    resolution: float
    falloff: float
    max_distance: float
    power: float
    explored: npt.NDArray[np.bool_] | None = None

    def by_twin(self) -> FieldGrid:
        return compute_idw_field(
            self.samples,
            bbox_min_x=self.min_x,
            bbox_min_y=self.min_y,
            bbox_max_x=self.min_x + self.width * self.resolution,
            bbox_max_y=self.min_y + self.height * self.resolution,
            resolution=self.resolution,
            falloff_radius_m=self.falloff,
            max_distance_m=self.max_distance,
            power=self.power,
            explored_mask=self.explored,
        )

    def by_loop(self) -> list[float]:
        return field_by_loop(
            self.samples,
            width=self.width,
            height=self.height,
            bbox_min_x=self.min_x,
            bbox_min_y=self.min_y,
            resolution=self.resolution,
            falloff_radius_m=self.falloff,
            max_distance_m=self.max_distance,
            power=self.power,
            explored=None if self.explored is None else self.explored.tolist(),
        )


def positions(cells: int) -> st.SearchStrategy[float]:
    """Along one axis, in cells: often on a centre or a corner, where distances tie, often not."""
    exact = st.integers(-6, 2 * cells + 6).map(lambda halves: halves / 2)
    anywhere = st.floats(-3.0, cells + 3.0)
    return st.one_of(exact, anywhere, exact.map(lambda position: position + 1e-4))


# In cells; 2.5 and 5 are the long sides of right triangles with legs on the grid.
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
    if spots and again:  # a second tag at the same spot
        x, y, _ = draw(st.sampled_from(spots))
        spots.append((x, y, draw(VALUES)))
    falloff = draw(RADII)
    explored = None
    if draw(st.integers(0, 3)) == 0:
        cells = st.lists(st.booleans(), min_size=width * height, max_size=width * height)
        explored = np.array(draw(cells), dtype=np.bool_).reshape(height, width)
    return Case(
        samples=tuple((min_x + x * resolution, min_y + y * resolution, v) for x, y, v in spots),
        width=width,
        height=height,
        min_x=min_x,
        min_y=min_y,
        resolution=resolution,
        falloff=falloff * resolution,
        max_distance=draw(st.one_of(st.just(falloff), RADII)) * resolution,
        power=draw(st.sampled_from([2.0, 2.0, 2.0, 0.0, 0.5, 1.0, 3.0, 4.5, 60.0])),
        explored=explored,
    )


@contextmanager
def small_parts() -> Iterator[None]:
    """Make the engine split even a tiny grid, down to single cells."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(idw, "_MAX_PAIRS", 12)
        patch.setattr(idw, "_MIN_PAIRS", 12)
        patch.setattr(idw, "_MIN_POINTS", 1)
        yield


@settings(max_examples=1200)
@given(cases())
def test_field_is_the_definitions(case: Case) -> None:
    grid = case.by_twin()
    assert (grid.width, grid.height) == (case.width, case.height)
    assert_same_values(grid.values, case.by_loop(), case.samples)


@settings(max_examples=800)
@given(cases())
def test_field_is_the_definitions_however_it_is_split(case: Case) -> None:
    with small_parts():
        grid = case.by_twin()
    assert_same_values(grid.values, case.by_loop(), case.samples)


@pytest.mark.parametrize("resolution", [0.001, 10.0])
@pytest.mark.parametrize(("falloff", "max_distance"), [(1.5, 1.5), (0.7, 1.5), (2.5, 1.5)])
def test_field_of_many_parts_is_the_definitions(
    resolution: float, falloff: float, max_distance: float
) -> None:
    """Large enough to be split by the engine's own measure, with a hundred tags in one cell."""
    rng = np.random.default_rng(7)
    spots = np.vstack([rng.uniform(-2, 70, (60, 2)), rng.uniform(10.0, 11.0, (100, 2))])
    case = Case(
        samples=tuple((x * resolution, y * resolution, 20 + x / 7) for x, y in spots.tolist()),
        width=64,
        height=48,
        min_x=0.0,
        min_y=0.0,
        resolution=resolution,
        falloff=falloff * 4 * resolution,
        max_distance=max_distance * 4 * resolution,
        power=2.0,
    )
    assert_same_values(case.by_twin().values, case.by_loop(), case.samples)


@pytest.mark.parametrize(("width", "height"), [(6, 6), (40, 1), (1, 40)])
def test_field_of_more_samples_than_fit_at_once_is_the_definitions(width: int, height: int) -> None:
    rng = np.random.default_rng(11)
    spots = rng.uniform(0.0, 1.0, (9000, 2)) * (width, height)
    case = Case(
        samples=tuple((x, y, 20 + x) for x, y in spots.tolist()),
        width=width,
        height=height,
        min_x=0.0,
        min_y=0.0,
        resolution=1.0,
        falloff=30.0,
        max_distance=50.0,
        power=2.0,
    )
    assert_same_values(case.by_twin().values, case.by_loop(), case.samples)


# --- what may not change it ------------------------------------------------------------------


@st.composite
def exact_cases(draw: st.DrawFn) -> Case:
    """All lengths are multiples of 1/8 m below 2⁸ m: sums and differences of them are exact."""
    width, height = draw(st.integers(1, 8)), draw(st.integers(1, 8))
    eighths = st.integers(-16, 80).map(lambda number: number / 8)
    return Case(
        samples=tuple(draw(st.lists(st.tuples(eighths, eighths, VALUES), max_size=10))),
        width=width,
        height=height,
        min_x=draw(st.integers(-8, 8)) / 8,
        min_y=draw(st.integers(-8, 8)) / 8,
        resolution=draw(st.sampled_from([0.25, 0.5, 1.0])),
        falloff=draw(st.integers(0, 40)) / 8,
        max_distance=draw(st.integers(0, 40)) / 8,
        power=draw(st.sampled_from([2.0, 1.0, 3.0])),
    )


@settings(max_examples=300)
@given(exact_cases(), st.sampled_from([-(2.0**20), 2.0**8, 2.0**24]))
def test_moving_everything_moves_the_field(case: Case, by: float) -> None:
    moved = Case(
        **{
            **vars(case),
            "samples": tuple((x + by, y - by, value) for x, y, value in case.samples),
            "min_x": case.min_x + by,
            "min_y": case.min_y - by,
        }
    ).by_twin()
    assert (moved.origin_x, moved.origin_y) == (case.min_x + by, case.min_y - by)
    assert_same_values(moved.values, case.by_twin().values.tolist(), case.samples)


@settings(max_examples=300)
@given(exact_cases())
def test_mirroring_everything_mirrors_the_field(case: Case) -> None:
    mirrored = Case(
        **{
            **vars(case),
            "samples": tuple((-x, y, value) for x, y, value in case.samples),
            "min_x": -(case.min_x + case.width * case.resolution),
        }
    ).by_twin()
    rows = case.by_twin().values.reshape(case.height, case.width)
    assert_same_values(mirrored.values, rows[:, ::-1].ravel().tolist(), case.samples)


@settings(max_examples=200)
@given(exact_cases(), st.sampled_from([-2.0, 0.25, 1024.0]))
def test_scaling_the_values_scales_the_field(case: Case, factor: float) -> None:
    samples = tuple((x, y, value * factor) for x, y, value in case.samples)
    scaled = Case(**{**vars(case), "samples": samples}).by_twin()
    expected = [value * factor for value in case.by_twin().values.tolist()]
    assert_same_values(scaled.values, expected, samples)


@settings(max_examples=200)
@given(exact_cases(), VALUES, st.integers(0, 10))
def test_a_sample_out_of_reach_changes_nothing(case: Case, value: float, index: int) -> None:
    # 80 m away from all of it; the reach is 5 m at most.
    samples = (*case.samples[:index], (100.0, -80.0, value), *case.samples[index:])
    grid = Case(**{**vars(case), "samples": samples}).by_twin()
    assert_same_values(grid.values, case.by_twin().values.tolist(), samples)


# --- rule by rule ----------------------------------------------------------------------------


def test_unexplored_cells_are_nan_whatever_lies_there() -> None:
    mask = np.array([[True, False], [False, True]])
    grid = field_over(2, 2, [(0.5, 0.5, 1.0), (1.5, 0.5, 2.0)], explored_mask=mask)
    np.testing.assert_array_equal(np.isnan(grid.values), [False, True, True, False])
    assert grid.values[0] == 1.0


@pytest.mark.parametrize("power", [2.0, 3.0])
@pytest.mark.parametrize("falloff", [0.5, 1.5, 3.0])
def test_gate_lets_through_at_its_distance_and_not_beyond(falloff: float, power: float) -> None:
    rules = {"falloff_radius_m": falloff, "max_distance_m": 1.5, "power": power}
    assert field_at_origin([(0.9, 1.2, 7.0)], **rules) == 7.0
    assert field_at_origin([(1.5, 0.0, 7.0)], **rules) == 7.0
    assert math.isnan(field_at_origin([(math.nextafter(1.5, 2.0), 0.0, 7.0)], **rules))


@pytest.mark.parametrize("power", [2.0, 3.0])
def test_gate_is_the_nearest_samples_and_comes_before_the_falloff(power: float) -> None:
    samples = [(1.6, 0.0, 7.0), (0.0, 1.7, 9.0)]
    assert math.isnan(
        field_at_origin(samples, falloff_radius_m=5.0, max_distance_m=1.5, power=power)
    )
    near_too = [*samples, (1.4, 0.0, 8.0)]
    value = field_at_origin(near_too, falloff_radius_m=5.0, max_distance_m=1.5, power=power)
    assert 7.0 < value < 9.0
    assert value != 8.0


@pytest.mark.parametrize("power", [2.0, 3.0])
def test_gate_comes_before_coincidence(power: float) -> None:
    samples = [(0.0008, 0.0, 7.0)]
    rules = {"falloff_radius_m": 0.0005, "max_distance_m": 0.0005, "power": power}
    assert math.isnan(field_at_origin(samples, **rules))
    assert field_at_origin(samples, **{**rules, "max_distance_m": 0.0008}) == 7.0


@pytest.mark.parametrize("power", [2.0, 3.0])
@pytest.mark.parametrize("falloff", [0.0, 1.0, 1.5, 3.0])
def test_coincident_sample_is_taken_exactly(power: float, falloff: float) -> None:
    closer = math.nextafter(COINCIDENT_EPS_M, 0.0)
    samples = [(0.002, 0.0, 1e6), (closer, 0.0, 7.0)]
    assert field_at_origin(samples, falloff_radius_m=falloff, power=power) == 7.0


def test_sample_a_little_closer_than_that_is_exact_beside_a_very_large_one() -> None:
    # Its weight is hardly above that at the distance itself; averaged it would be 3.8.
    assert field_at_origin([(0.97 * COINCIDENT_EPS_M, 0.0, 0.0), (0.5, 0.0, 1e6)]) == 0.0


@pytest.mark.parametrize(("power", "weights"), [(2.0, (1e6, 4.0)), (3.0, (1e9, 8.0))])
def test_sample_at_the_coincidence_distance_is_averaged(
    power: float, weights: tuple[float, float]
) -> None:
    samples = [(COINCIDENT_EPS_M, 0.0, 0.0), (0.5, 0.0, 1e6)]
    expected = 1e6 * weights[1] / sum(weights)
    assert field_at_origin(samples, power=power) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("power", [2.0, 3.0])
def test_nearest_of_several_coincident_samples_is_taken(power: float) -> None:
    samples = [(0.0005, 0.0, 1.0), (0.0002, 0.0, 2.0), (0.0, 0.0004, 3.0)]
    assert field_at_origin(samples, power=power) == 2.0


@pytest.mark.parametrize("power", [2.0, 3.0])
@pytest.mark.parametrize("distance", [0.0, 0.0005])
def test_first_of_equally_coincident_samples_wins(power: float, distance: float) -> None:
    samples = [(distance, 0.0, 5.0), (0.0, distance, 6.0), (-distance, 0.0, 4.0)]
    assert field_at_origin(samples, power=power) == 5.0
    assert field_at_origin(samples[1:], power=power) == 6.0


def test_weights_are_the_inverse_power_of_the_distance() -> None:
    samples = [(1.0, 0.0, 10.0), (0.0, 0.5, 20.0)]
    assert field_at_origin(samples, power=2.0) == pytest.approx((10 + 20 * 4) / 5, rel=1e-7)
    assert field_at_origin(samples, power=1.0) == pytest.approx((10 + 20 * 2) / 3, rel=1e-7)
    assert field_at_origin(samples, power=3.0) == pytest.approx((10 + 20 * 8) / 9, rel=1e-7)
    assert field_at_origin(samples, power=0.0) == pytest.approx(15.0)


@pytest.mark.parametrize("power", [2.0, 3.0])
def test_falloff_takes_in_samples_at_its_radius_and_not_beyond(power: float) -> None:
    beyond = math.nextafter(1.0, 2.0)
    rules = {"falloff_radius_m": 1.0, "max_distance_m": 2.0, "power": power}
    assert field_at_origin([(1.0, 0.0, 10.0), (0.0, -1.0, 20.0)], **rules) == 15.0
    assert field_at_origin([(1.0, 0.0, 10.0), (0.0, -beyond, 20.0)], **rules) == 10.0
    assert field_at_origin([(beyond, 0.0, 10.0), (0.0, -1.0, 20.0)], **rules) == 20.0


@pytest.mark.parametrize("power", [2.0, 3.0])
def test_nearest_sample_fills_the_gap_between_falloff_and_gate(power: float) -> None:
    rules = {"falloff_radius_m": 0.5, "max_distance_m": 2.0, "power": power}
    assert field_at_origin([(1.2, 0.0, 10.0), (0.0, 1.1, 20.0)], **rules) == 20.0
    # Equally near: the first.
    assert field_at_origin([(0.0, 1.5, 3.0), (0.9, 1.2, 1.0), (1.5, 0.0, 2.0)], **rules) == 3.0
    assert field_at_origin([(0.9, 1.2, 1.0), (1.5, 0.0, 2.0)], **rules) == 1.0


def test_equal_distances_tie_although_their_squares_are_a_rounding_apart() -> None:
    """The tie is one of distances. These two are the same float64, and their squares are not."""
    first, second = (0.3, 1.1), (1.0, 0.55)
    scale = math.dist(first, (0, 0)) / math.dist(second, (0, 0))
    candidates = (
        (second[0] * scale * (1 + step * 2**-52), second[1] * scale) for step in range(-8, 9)
    )
    square = first[0] ** 2 + first[1] ** 2
    tied = [
        (x, y)
        for x, y in candidates
        if x * x + y * y < square and math.sqrt(x * x + y * y) == math.sqrt(square)
    ]
    assert tied
    for x, y in tied:
        samples = [(*first, 10.0), (x, y, 20.0)]
        assert field_at_origin(samples, falloff_radius_m=0.5, max_distance_m=2.0) == 10.0


@pytest.mark.parametrize("power", [2.0, 3.0])
def test_distance_at_a_radius_is_within_although_its_square_is_not(power: float) -> None:
    """0.8 and 1.5 are the legs of a triangle whose long side, 1.7, is met exactly by rounding."""
    assert 0.8 * 0.8 + 1.5 * 1.5 > 1.7 * 1.7
    assert math.sqrt(0.8 * 0.8 + 1.5 * 1.5) == 1.7
    gate = {"falloff_radius_m": 0.0, "max_distance_m": 1.7, "power": power}
    assert field_at_origin([(0.8, 1.5, 7.0)], **gate) == 7.0
    falloff = {"falloff_radius_m": 1.7, "max_distance_m": 3.0, "power": power}
    assert field_at_origin([(0.8, 1.5, 10.0), (1.5, 0.8, 20.0)], **falloff) == 15.0


def test_sample_outside_the_box_reaches_into_it() -> None:
    grid = field_over(2, 1, [(-0.5, 0.5, 7.0)], max_distance_m=1.0, falloff_radius_m=1.0)
    np.testing.assert_array_equal(grid.values, np.array([7.0, np.nan], dtype=np.float32))


# --- the grid --------------------------------------------------------------------------------


def test_rows_run_up_from_the_lower_edge_and_cells_are_centred() -> None:
    grid = compute_idw_field(
        [(10.75, 20.25, 1.0), (10.25, 20.75, 2.0), (11.25, 20.75, 3.0)],
        bbox_min_x=10.0,
        bbox_min_y=20.0,
        bbox_max_x=11.5,
        bbox_max_y=21.0,
        resolution=0.5,
        falloff_radius_m=0.1,
        max_distance_m=0.1,
        power=2.0,
    )
    assert (grid.width, grid.height, grid.resolution) == (3, 2, 0.5)
    assert (grid.origin_x, grid.origin_y) == (10.0, 20.0)
    nan = math.nan
    np.testing.assert_array_equal(
        grid.values, np.array([nan, 1.0, nan, 2.0, nan, 3.0], dtype=np.float32)
    )
    np.testing.assert_array_equal(cell_centres(10.0, 3, 0.5), [10.25, 10.75, 11.25])


def test_grid_is_flat_float32_and_cannot_be_written_to() -> None:
    grid = field_over(3, 2, [FieldSample(x=1.0, y=1.0, value=5.0)])
    assert grid.values.shape == (6,)
    assert grid.values.dtype == np.float32
    for array in (grid.values, grid.values.base):
        assert array is not None
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0.0
    with pytest.raises(AttributeError):
        grid.width = 7  # type: ignore[misc]


def test_range_is_that_of_the_finite_cells() -> None:
    grid = field_over(
        5, 1, [(0.5, 0.5, -3.5), (4.5, 0.5, 8.25)], max_distance_m=1.0, falloff_radius_m=1.0
    )
    assert (grid.value_min, grid.value_max) == (-3.5, 8.25)
    assert type(grid.value_min) is float
    assert np.isnan(grid.values[2])


def test_range_is_zero_where_nothing_is_known() -> None:
    for samples in ([], [(50.0, 50.0, 9.0)]):
        grid = field_over(3, 3, samples)
        assert np.isnan(grid.values).all()
        assert (grid.value_min, grid.value_max) == (0.0, 0.0)
        assert grid.sample_count == len(samples)


def test_range_leaves_out_what_float32_cannot_hold() -> None:
    samples = [(0.5, 0.5, 1e39), (3.5, 0.5, 8.0), (6.5, 0.5, -1e39)]
    grid = field_over(7, 1, samples, max_distance_m=0.5, falloff_radius_m=0.5)
    assert (grid.values[0], grid.values[6]) == (math.inf, -math.inf)
    assert (grid.value_min, grid.value_max) == (8.0, 8.0)
    only = field_over(1, 1, samples[:1])
    assert (only.value_min, only.value_max) == (0.0, 0.0)


def test_sample_count_is_of_the_samples_given() -> None:
    assert field_over(2, 2, [(0.0, 0.0, 1.0), (1.0, 1.0, 2.0), (99.0, 0.0, 3.0)]).sample_count == 3


# --- at the extremes -------------------------------------------------------------------------


@pytest.mark.parametrize("power", [100.0, 1000.0])
def test_high_powers_neither_overflow_nor_vanish(power: float) -> None:
    # 0.0011^-1000 overflows float64, and 1000^-1000 vanishes.
    assert field_at_origin([(0.0011, 0.0, 5.0), (0.0, 0.0022, 9.0)], power=power) == 5.0
    far = {"falloff_radius_m": 2000.0, "max_distance_m": 2000.0, "power": power}
    assert field_at_origin([(1000.0, 0.0, 5.0), (0.0, 1990.0, 9.0)], **far) == 5.0
    assert field_at_origin([(1000.0, 0.0, 5.0), (0.0, 1000.0, 9.0)], **far) == 7.0


def test_enormous_distances_still_weigh() -> None:
    far = {"falloff_radius_m": 1e150, "max_distance_m": 1e150}
    samples = [(1e140, 0.0, 10.0), (0.0, 2e140, 20.0)]
    assert field_at_origin(samples, **far) == pytest.approx((10 * 4 + 20) / 5)
    # v/d² vanishes here, and the mean must not.
    tiny = [(1e149, 0.0, 1e-28), (0.0, 1e149, 3e-28)]
    assert field_at_origin(tiny, **far) == pytest.approx(2e-28, rel=1e-6, abs=0.0)
    # A reach whose square overflows takes in whatever has a finite distance.
    assert field_at_origin(samples, falloff_radius_m=1e300, max_distance_m=1e300) > 0.0


def test_a_square_that_overflows_is_out_of_reach() -> None:
    assert math.isnan(field_at_origin([(1e200, 0.0, 5.0)]))
    assert field_at_origin([(1e200, 0.0, 5.0), (0.5, 0.0, 6.0)]) == 6.0


def test_enormous_readings_do_not_poison_their_neighbours() -> None:
    usual = (0.5, 0.0, 20.0)
    # Their sums would overflow, and inf - inf is NaN. The nearer of the two decides.
    assert field_at_origin([(0.01, 0.0, 1.7e308), (-0.02, 0.0, -1.7e308), usual]) == math.inf
    assert field_at_origin([(0.02, 0.0, 1.7e308), (-0.01, 0.0, -1.7e308), usual]) == -math.inf
    # Here neither does: what is left is the rounding of the one less that of the other.
    assert not math.isnan(field_at_origin([(0.01, 0.0, 1.7e308), (-0.01, 0.0, -1.7e308), usual]))


def test_readings_of_many_sizes_keep_their_precision() -> None:
    samples = [(0.5, 0.0, 1e-30), (0.0, 0.5, 3e-30)]
    assert field_at_origin(samples) == pytest.approx(2e-30, rel=1e-6, abs=0.0)


@pytest.mark.parametrize("resolution", [1e-9, 1e-6])
def test_cells_finer_than_the_coincidence_distance_share_one_sample(resolution: float) -> None:
    grid = field_over(40, 30, [(0.0, 0.0, 4.0), (0.0, 0.0, 5.0)], resolution=resolution)
    assert (grid.values == 4.0).all()


@pytest.mark.parametrize("cells", [100, 200, 500])
@pytest.mark.parametrize(
    ("count", "reach", "falloff", "power"),
    [
        (300, 1.5, 1.5, 2.0),
        (30, 100.0, 100.0, 2.0),
        (30, 100.0, 0.1, 2.0),
        (100, 3.0, 5.0, 1.5),
    ],
)
def test_memory_stays_within_ten_times_the_grid(
    cells: int, count: int, reach: float, falloff: float, power: float
) -> None:
    rng = np.random.default_rng(3)
    samples = [FieldSample(x, y, x + y) for x, y in rng.uniform(0.0, 20.0, (count, 2)).tolist()]
    mask = rng.random((cells, cells)) < 0.7
    tracemalloc.start()
    try:
        grid = field_over(
            cells,
            cells,
            samples,
            resolution=20.0 / cells,
            max_distance_m=reach,
            falloff_radius_m=falloff,
            power=power,
            explored_mask=mask,
        )
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak <= 10 * grid.values.nbytes
    assert not np.isnan(grid.values).all()


@pytest.fixture
def evaluated_pairs(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The numbers of cell-sample pairs that are looked at from here on."""
    pairs: list[int] = []
    evaluate = idw.PairwiseIdw.evaluate

    def counting(self: Any, square: Any, value: Any) -> Any:
        pairs.append(square.size)
        return evaluate(self, square, value)

    monkeypatch.setattr(idw.PairwiseIdw, "evaluate", counting)
    return pairs


def test_cost_follows_the_painted_cells(evaluated_pairs: list[int]) -> None:
    """One tag paints 2,800 of a million cells: no more pairs than of its own part of the grid."""
    grid = field_over(1000, 1000, [(25.0, 25.0, 20.0)], resolution=0.05)
    assert np.count_nonzero(~np.isnan(grid.values)) < 3000
    assert sum(evaluated_pairs) < 200_000


def test_tags_far_outside_the_box_cost_nothing(evaluated_pairs: list[int]) -> None:
    rng = np.random.default_rng(5)
    inside = [(x, y, 20.0) for x, y in rng.uniform(0, 10, (30, 2)).tolist()]
    far = [(x, y, 20.0) for x, y in rng.uniform(500, 510, (300, 2)).tolist()]
    field_over(200, 200, inside, resolution=0.05)
    without = list(evaluated_pairs)
    evaluated_pairs.clear()
    field_over(200, 200, [*far, *inside], resolution=0.05)
    assert evaluated_pairs == without


def test_unexplored_ground_costs_nothing(evaluated_pairs: list[int]) -> None:
    samples = [(0.1 * i, 0.1 * i, 20.0) for i in range(100)]
    mask = np.zeros((200, 200), dtype=np.bool_)
    field_over(200, 200, samples, resolution=0.05, explored_mask=mask)
    assert evaluated_pairs == []
    mask[:20, :20] = True
    field_over(200, 200, samples, resolution=0.05, explored_mask=mask)
    assert 0 < sum(evaluated_pairs) < 200 * 200 * 100 / 10


def test_any_number_of_threads_may_compute() -> None:
    samples = [(0.37 * i % 9, 0.73 * i % 9, float(i)) for i in range(40)]
    expected = field_over(180, 180, samples, resolution=0.05).values
    with ThreadPoolExecutor(4) as pool:
        grids = list(pool.map(lambda _: field_over(180, 180, samples, resolution=0.05), range(16)))
    for grid in grids:
        np.testing.assert_array_equal(grid.values, expected)


# --- refusals --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"falloff_radius_m": -0.1}, r"falloff_radius_m is -0\.1, must not be less than 0"),
        ({"falloff_radius_m": math.nan}, "falloff_radius_m is nan, must be finite"),
        ({"max_distance_m": math.inf}, "max_distance_m is inf, must be finite"),
        ({"max_distance_m": -1.0}, r"max_distance_m is -1\.0, must not be less than 0"),
        ({"power": -2.0}, r"power is -2\.0, must not be less than 0"),
        ({"power": math.nan}, "power is nan, must be finite"),
        ({"explored_mask": np.ones((3, 2), dtype=np.bool_)}, r"shape \(3, 2\), must be bool"),
        ({"explored_mask": np.ones((2, 3))}, "float64 of shape"),
        ({"resolution": 0.0}, r"resolution is 0\.0 m, must be greater than 0"),
    ],
)
def test_rules_out_of_range_are_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        field_over(3, 2, [(0.0, 0.0, 1.0)], **changes)


@pytest.mark.parametrize(
    ("samples", "message"),
    [
        ([(0.0, 0.0, 1.0), (0.0, math.nan, 1.0)], r"samples\[1\]\.y is nan, must be finite"),
        ([(math.inf, 0.0, 1.0)], r"samples\[0\]\.x is inf"),
        ([(0.0, 0.0, -math.inf)], r"samples\[0\]\.value is -inf"),
        ([(0.0, 0.0)], "samples hold 2 numbers, must be 3 each of 1"),
    ],
)
def test_samples_that_are_no_samples_are_refused(samples: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        field_over(3, 2, samples)
