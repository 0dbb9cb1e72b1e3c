"""GetField without ROS: refusals, the cache, the grid, and clipping to explored space."""

import itertools
import math
import tracemalloc
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from lupin_twin.core.drops import MAX_TEXT_LENGTH
from lupin_twin.core.state import Observation, Pose, TwinStore
from lupin_twin.field import idw
from lupin_twin.field.engine import (
    MAX_ENTRIES,
    FieldCache,
    FieldRefused,
    FieldRequest,
    FieldRules,
    check_request,
    compute_field,
    cost_s,
    default_box,
    default_request,
)
from lupin_twin.field.grid import FieldGrid, grid_dimensions
from lupin_twin.field.idw import Abandoned, compute_idw_field
from tests.support.maps import map_of

MAX_CELLS = 1_000_000


def request_of(**changes: Any) -> FieldRequest:
    """A request for 4 x 2 cells of 1 m from the origin, unless changed."""
    given = {
        "sensor_type": "temperature",
        "resolution": 1.0,
        "bbox_min_x": 0.0,
        "bbox_min_y": 0.0,
        "bbox_max_x": 4.0,
        "bbox_max_y": 2.0,
    }
    return FieldRequest(**{**given, **changes})


def rules_of(**changes: Any) -> FieldRules:
    given = {
        "idw_power": 2.0,
        "falloff_radius_m": 1.5,
        "max_distance_m": 1.5,
        "max_grid_cells": MAX_CELLS,
        "clip_to_explored": True,
    }
    return FieldRules(**{**given, **changes})


def scan(tag_id: str, x: float, y: float, value: float) -> Observation:
    return Observation(
        tag_id=tag_id,
        stamp_ns=1,
        readings={"temperature": value},
        pose=Pose(x, y, 0.5, 0.0, 0.0, 0.0, 1.0),
    )


@pytest.fixture
def store() -> TwinStore:
    """Two tags, at the centres of the request's cells (0, 0) and (3, 1)."""
    store = TwinStore()
    store.record(scan("a", 0.5, 0.5, 10.0))
    store.record(scan("b", 3.5, 1.5, 20.0))
    return store


def answer(store: TwinStore, **rules: float) -> FieldGrid:
    samples = store.samples_for_sensor("temperature")
    return compute_field(request_of(), samples, None, rules_of(**rules))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"sensor_type": ""}, "sensor_type is empty, must name a sensor"),
        (
            {"sensor_type": "t" * (MAX_TEXT_LENGTH + 1)},
            f"has {MAX_TEXT_LENGTH + 1} characters, the limit is {MAX_TEXT_LENGTH}",
        ),
        ({"resolution": 0.0}, r"resolution is 0\.0 m, must be greater than 0"),
        ({"resolution": -1.0}, r"resolution is -1\.0 m, must be greater than 0"),
        ({"resolution": math.nan}, "resolution is nan, must be finite"),
        ({"resolution": math.inf}, "resolution is inf, must be finite"),
        ({"bbox_min_x": math.nan}, "bbox_min_x is nan, must be finite"),
        ({"bbox_min_y": -math.inf}, "bbox_min_y is -inf, must be finite"),
        ({"bbox_max_x": 1e300}, r"bbox_max_x is 1e\+300 m, must fit into float32"),
        ({"resolution": 1e-50, "bbox_max_y": 1e39}, "resolution is 1e-50 m, must fit into float32"),
        ({"bbox_max_y": math.nan}, "bbox_max_y is nan, must be finite"),
        ({"bbox_min_x": 5.0}, r"bbox_max_x is 4\.0 m, must not be less than bbox_min_x \(5\.0 m\)"),
        ({"bbox_max_y": -1.0}, r"bbox_max_y is -1\.0 m, must not be less than bbox_min_y \(0\.0"),
        ({"resolution": 0.002}, r"0\.002 m makes 2000 x 1000 cells, the limit is 1000000 in all"),
    ],
)
def test_a_bad_request_is_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(FieldRefused, match=message):
        check_request(request_of(**changes), MAX_CELLS)


@pytest.mark.parametrize(
    "changes",
    [
        {"resolution": 1e-9, "bbox_max_x": 1000.0, "bbox_max_y": 1000.0},
        # 2³² x 2³² and 65,536 x 65,536 cells: 0 in 64 and in 32 bits.
        {"resolution": 2.0**-20, "bbox_max_x": 2.0**12, "bbox_max_y": 2.0**12},
        {"resolution": 1.0, "bbox_max_x": 65_536.0, "bbox_max_y": 65_536.0},
        # The quotient overflows float32, the extent too.
        {"resolution": 1e-45, "bbox_min_x": -3.4e38, "bbox_max_x": 3.4e38},
        {"resolution": 1e-45, "bbox_max_x": 3.4e38, "bbox_max_y": 3.4e38},
    ],
)
def test_a_grid_bomb_is_refused_without_an_allocation(changes: dict[str, Any]) -> None:
    request = request_of(**changes)
    tracemalloc.start()
    try:
        with pytest.raises(FieldRefused, match="the limit is 1000000 in all"):
            check_request(request, MAX_CELLS)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 20_000


def test_the_field_uses_the_samples_of_the_store_and_the_rules(store: TwinStore) -> None:
    grid = answer(store)
    assert (grid.width, grid.height, grid.sample_count) == (4, 2, 2)
    rows = grid.values.reshape(2, 4)
    assert (rows[0, 0], rows[1, 3]) == (10.0, 20.0)
    assert not np.isnan(rows[0, 1])
    narrow = answer(store, max_distance_m=0.5)
    assert np.isnan(narrow.values.reshape(2, 4)[0, 1])
    store.record(scan("c", 1.5, 0.5, 30.0))
    by_power = [answer(store, idw_power=power).values.reshape(2, 4)[1, 0] for power in (1.0, 2.0)]
    assert by_power[0] != by_power[1]
    # With no tag within the falloff, the nearest is used: "a", 1 m away.
    nearest = answer(store, falloff_radius_m=0.5)
    assert nearest.values.reshape(2, 4)[1, 0] == 10.0


def test_a_cancelled_job_ends_between_two_parts(store: TwinStore) -> None:
    """It checks so often that no two checks are more than some milliseconds apart."""
    for number in range(100):
        store.record(scan(f"far {number}", number * 1.0, 0.0, 1.0))
    rules = {"falloff_radius_m": 200.0, "max_distance_m": 200.0}
    samples = store.samples_for_sensor("temperature")
    compute = partial(compute_field, request_of(resolution=0.01), samples, None, rules_of(**rules))
    requested = itertools.count(1)
    compute(lambda: next(requested) == 0)
    assert next(requested) > 400 * 200 * 100 / idw.MAX_PAIRS
    answers = iter([False, False, True])
    with pytest.raises(Abandoned):
        compute(lambda: next(answers))
    assert next(answers, None) is None, "checked three times, and not again"


@pytest.mark.parametrize(
    ("samples", "changes", "rules", "expected_s"),
    [
        (0, {"resolution": 0.01}, {}, 400 * 200 * 20e-9),
        # Each sample reaches a window of 3 m.
        (10, {"resolution": 0.01}, {}, 400 * 200 * 20e-9 + 10 * 300 * 200 * 15e-9),
        # And no more than the box.
        (10, {}, {"max_distance_m": 50.0}, 8 * 20e-9 + 10 * 8 * 15e-9),
    ],
)
def test_cost_follows_cells_and_the_windows_of_the_samples(
    samples: int, changes: dict[str, Any], rules: dict[str, Any], expected_s: float
) -> None:
    cost = cost_s(request_of(**changes), samples, rules_of(**rules))
    assert cost == pytest.approx(expected_s, rel=0.01)


def test_a_map_clips_to_known_cells_wherever_the_box_begins(store: TwinStore) -> None:
    request, samples = request_of(bbox_min_x=1.0), store.samples_for_sensor("temperature")
    occupancy = map_of([[0, -1, 0, 0], [0, 0, 0, -1]])
    unclipped, clipped = (
        compute_field(request, samples, occupancy, rules_of(clip_to_explored=it)).values
        for it in (False, True)
    )
    assert not np.isnan(unclipped).any()
    known = np.array([0, 1, 1, 1, 1, 0], dtype=np.bool_)
    np.testing.assert_array_equal(clipped, np.where(known, unclipped, np.float32(np.nan)))


def test_the_default_box_covers_the_tags_and_their_reach() -> None:
    positions = ((x, y) for x, y in [(1.0, 5.0), (-2.0, 3.0), (0.0, 8.5)])
    assert default_box(positions, 1.5) == (-3.5, 1.5, 2.5, 10.0)


def test_cells_of_a_default_request_are_doubled_until_there_are_few_enough() -> None:
    box = (0.0, 0.0, 400.0, 300.0)
    assert default_request("co2", box, 12_000_000).resolution == np.float32(0.1)
    assert default_request("co2", box, 11_999_999).resolution == np.float32(0.2)
    assert default_request("co2", (-1e6, -1e6, 1e6, 1e6), 1).resolution >= 2e6


RULES = FieldRules(2.0, 1.5, 1.5, 1_000, clip_to_explored=False)


def grid(cells: int) -> FieldGrid:
    """A field of one row: 4 bytes a cell."""
    return compute_idw_field(
        [],
        bbox_min_x=0.0,
        bbox_min_y=0.0,
        bbox_max_x=float(cells),
        bbox_max_y=1.0,
        resolution=1.0,
        falloff_radius_m=1.0,
        max_distance_m=1.0,
        power=2.0,
    )


def test_64_fields_are_cached_and_the_least_recently_used_goes_first() -> None:
    cache = FieldCache(1e6)
    for number in range(MAX_ENTRIES):
        cache.put(number, grid(1))
    assert cache.get(0) is not None
    cache.put(100, grid(1))
    assert MAX_ENTRIES == 64
    assert len(cache) == 64
    assert cache.get(0) is not None
    assert cache.get(1) is None
    assert cache.get(2) is not None


def test_the_total_bytes_are_limited() -> None:
    cache = FieldCache(100)
    for number in range(5):
        cache.put(number, grid(10))
    assert (cache.bytes, len(cache)) == (80, 2)
    assert cache.get(3) is not None
    assert cache.get(4) is not None
    cache.put(5, grid(25))
    assert (cache.bytes, len(cache)) == (100, 1)


def test_a_field_larger_than_the_cache_is_not_cached_and_evicts_nothing() -> None:
    cache = FieldCache(100)
    cache.put(1, grid(10))
    cache.put(2, grid(26))
    assert cache.get(2) is None
    assert cache.get(1) is not None
    assert cache.bytes == 40


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
