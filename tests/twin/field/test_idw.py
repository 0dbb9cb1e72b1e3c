"""The field rule by rule, at the extremes, and against its definition, the oracle's loop."""

import math
import tracemalloc
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lupin_twin.field import idw
from lupin_twin.field.grid import FieldGrid
from lupin_twin.field.idw import COINCIDENT_EPS_M, FieldSample, compute_idw_field
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


@pytest.mark.parametrize("power", [2.0, 3.0])
@pytest.mark.parametrize("falloff", [0.0, 1.0, 1.5, 3.0])
def test_a_coincident_sample_is_taken_exactly(power: float, falloff: float) -> None:
    closer = math.nextafter(COINCIDENT_EPS_M, 0.0)
    samples = [(0.002, 0.0, 1e6), (closer, 0.0, 7.0)]
    assert field_at_origin(samples, falloff_radius_m=falloff, power=power) == 7.0


def test_equal_distances_tie_although_their_squares_differ_by_a_rounding() -> None:
    """The tie is between distances. These two are the same float64, and their squares are not."""
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
def test_a_distance_equal_to_the_radius_is_within_although_its_square_is_not(power: float) -> None:
    """0.8 and 1.5 are the legs of a right triangle whose hypotenuse rounds to exactly 1.7."""
    assert 0.8 * 0.8 + 1.5 * 1.5 > 1.7 * 1.7
    assert math.sqrt(0.8 * 0.8 + 1.5 * 1.5) == 1.7
    gate = {"falloff_radius_m": 0.0, "max_distance_m": 1.7, "power": power}
    assert field_at_origin([(0.8, 1.5, 7.0)], **gate) == 7.0
    falloff = {"falloff_radius_m": 1.7, "max_distance_m": 3.0, "power": power}
    assert field_at_origin([(0.8, 1.5, 10.0), (1.5, 0.8, 20.0)], **falloff) == 15.0


def test_the_range_leaves_out_what_float32_cannot_hold() -> None:
    samples = [(0.5, 0.5, 1e39), (3.5, 0.5, 8.0), (6.5, 0.5, -1e39)]
    grid = field_over(7, 1, samples, max_distance_m=0.5, falloff_radius_m=0.5)
    assert (grid.values[0], grid.values[6]) == (math.inf, -math.inf)
    assert (grid.value_min, grid.value_max) == (8.0, 8.0)
    only = field_over(1, 1, samples[:1])
    assert (only.value_min, only.value_max) == (0.0, 0.0)


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
def test_invalid_samples_are_refused(samples: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        field_over(3, 2, samples)


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
    # A reach whose square overflows includes every finite distance.
    assert field_at_origin(samples, falloff_radius_m=1e300, max_distance_m=1e300) > 0.0


def test_a_square_that_overflows_is_out_of_reach() -> None:
    assert math.isnan(field_at_origin([(1e200, 0.0, 5.0)]))
    assert field_at_origin([(1e200, 0.0, 5.0), (0.5, 0.0, 6.0)]) == 6.0


def test_enormous_readings_do_not_poison_their_neighbours() -> None:
    usual = (0.5, 0.0, 20.0)
    # Their sums would overflow, and inf - inf is NaN. The nearer of the two decides.
    assert field_at_origin([(0.01, 0.0, 1.7e308), (-0.02, 0.0, -1.7e308), usual]) == math.inf
    assert field_at_origin([(0.02, 0.0, 1.7e308), (-0.01, 0.0, -1.7e308), usual]) == -math.inf
    # Here neither decides: the rest is the difference of their roundings.
    assert not math.isnan(field_at_origin([(0.01, 0.0, 1.7e308), (-0.01, 0.0, -1.7e308), usual]))


@pytest.mark.parametrize("resolution", [1e-9, 1e-6])
def test_cells_finer_than_the_coincidence_distance_share_one_sample(resolution: float) -> None:
    grid = field_over(40, 30, [(0.0, 0.0, 4.0), (0.0, 0.0, 5.0)], resolution=resolution)
    assert (grid.values == 4.0).all()


@pytest.mark.parametrize("cells", [300, 500])
@pytest.mark.parametrize(
    ("count", "reach", "falloff", "power"),
    [(300, 1.5, 1.5, 2.0), (30, 100.0, 100.0, 2.0), (30, 100.0, 0.1, 2.0), (100, 3.0, 5.0, 1.5)],
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
    """The number of cell-sample pairs that are evaluated from here on."""
    pairs: list[int] = []
    evaluate = idw.PairwiseIdw.evaluate

    def counting(self: Any, square: Any, value: Any) -> Any:
        pairs.append(square.size)
        return evaluate(self, square, value)

    monkeypatch.setattr(idw.PairwiseIdw, "evaluate", counting)
    return pairs


def test_cost_follows_the_painted_cells(evaluated_pairs: list[int]) -> None:
    """One tag paints 2,800 of a million cells: no more pairs than in its own part of the grid."""
    grid = field_over(1000, 1000, [(25.0, 25.0, 20.0)], resolution=0.05)
    assert np.count_nonzero(~np.isnan(grid.values)) < 3000
    assert sum(evaluated_pairs) < 300_000


def test_unexplored_ground_costs_nothing(evaluated_pairs: list[int]) -> None:
    samples = [(0.1 * i, 0.1 * i, 20.0) for i in range(100)]
    mask = np.zeros((200, 200), dtype=np.bool_)
    field_over(200, 200, samples, resolution=0.05, explored_mask=mask)
    assert evaluated_pairs == []
    mask[:20, :20] = True
    field_over(200, 200, samples, resolution=0.05, explored_mask=mask)
    assert 0 < sum(evaluated_pairs) < 200 * 200 * 100 / 10


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
