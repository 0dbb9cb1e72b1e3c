"""The field at the extremes: overflowing numbers, and its cost in memory and time."""

import math
import tracemalloc
from typing import Any

import numpy as np
import pytest

from lupin_twin.field import idw
from lupin_twin.field.idw import FieldSample
from tests.twin.field.test_idw import field_at_origin, field_over


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
