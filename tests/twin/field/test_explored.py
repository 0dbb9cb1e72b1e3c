"""A map's explored cells, its free places, and its row in the journal."""

import base64
import json
import math
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lupin_twin.field import explored
from lupin_twin.field.explored import (
    LEAST_APART_M,
    MARGIN_M,
    MAX_PACKED_CELLS,
    MAX_PLACES,
    OccupancyMap,
    explored_mask,
    floor,
    free_of,
    text_of,
)
from lupin_twin.field.explored import (
    map_of as read_map,
)
from lupin_twin.journal.writer import Journal
from tests.support import maps
from tests.support.journal import CLOCK, LIMITS, select
from tests.support.maps import map_of
from tests.support.waiting import wait_for


def mask_of(
    occupancy: OccupancyMap,
    width: int,
    height: int,
    *,
    origin: tuple[float, float] = (0.0, 0.0),
    resolution: float = 1.0,
) -> npt.NDArray[np.bool_]:
    mask = explored_mask(
        occupancy,
        width=width,
        height=height,
        origin_x=origin[0],
        origin_y=origin[1],
        resolution=resolution,
    )
    assert mask.shape == (height, width)
    assert mask.dtype == np.bool_
    return mask


def test_known_cells_are_explored_and_unknown_ones_are_not() -> None:
    occupancy = map_of([[0, 100, -1], [50, -128, 101], [127, 1, 99]])
    np.testing.assert_array_equal(
        mask_of(occupancy, 3, 3), [[True, True, False], [True, False, False], [False, True, True]]
    )


def test_a_centre_on_an_edge_belongs_to_the_upper_cell_whatever_the_rounding() -> None:
    """Cells of 0.1 m over a map of 0.05 m: every centre lies on an edge of the map's cells.

    On the wire, both resolutions are float32, and neither is exact.
    """
    columns = 400
    rows = np.full((1, columns), -1)
    rows[0, 1::2] = 0
    for map_resolution in (0.05, float(np.float32(0.05))):
        for field_resolution in (0.1, float(np.float32(0.1))):
            occupancy = map_of(rows, resolution=map_resolution, origin_y=-0.01)
            mask = mask_of(
                occupancy, columns // 2, 1, resolution=field_resolution, origin=(0.0, -0.05)
            )
            assert mask.all()


@settings(max_examples=150)
@given(
    seed=st.integers(0, 1000),
    yaw=st.one_of(st.just(0.0), st.floats(-math.pi, math.pi)),
    origin=st.tuples(st.floats(-3, 3), st.floats(-3, 3)),
    map_resolution=st.sampled_from([0.05, 0.3, 1.0]),
    resolution=st.sampled_from([0.1, 0.25, 0.7]),
)
def test_the_mask_is_the_map_cell_under_each_centre(
    seed: int, yaw: float, origin: tuple[float, float], map_resolution: float, resolution: float
) -> None:
    """By a plain loop: each centre, transformed into the map's own frame."""
    rows = np.random.default_rng(seed).choice([-1, 0, 100], size=(9, 13))
    occupancy = map_of(
        rows, resolution=map_resolution, origin_x=origin[0], origin_y=origin[1], origin_yaw=yaw
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(explored, "CELLS_AT_ONCE", 40)
        mask = mask_of(occupancy, 14, 11, origin=(-2.0, -1.5), resolution=resolution)
    for row in range(11):
        for column in range(14):
            dx = -2.0 + (column + 0.5) * resolution - origin[0]
            dy = -1.5 + (row + 0.5) * resolution - origin[1]
            along = (math.cos(yaw) * dx + math.sin(yaw) * dy) / map_resolution
            across = (math.cos(yaw) * dy - math.sin(yaw) * dx) / map_resolution
            if max(along - math.floor(along), across - math.floor(across)) > 0.999:
                continue  # an edge, a rounding apart
            i, j = math.floor(along), math.floor(across)
            known = 0 <= i < 13 and 0 <= j < 9 and rows[j, i] >= 0
            assert mask[row, column] == known


def test_cells_are_a_read_only_copy_by_rows() -> None:
    data = np.array([0, -1, 100, 50, 7, -1], dtype=np.int8)
    occupancy = map_of(np.zeros((2, 3)), cells=data)
    data[0] = 42
    np.testing.assert_array_equal(occupancy.cells, [[0, -1, 100], [50, 7, -1]])
    with pytest.raises(ValueError, match="read-only"):
        occupancy.cells[0, 0] = 1


@pytest.mark.parametrize(
    "changes",
    [
        {"frame_id": "other"},
        {"width": 1, "height": 2},
        {"resolution": 2.0},
        {"origin_x": 1.0},
        {"origin_y": 1.0},
        {"origin_yaw": 1.0},
        {"cells": [0, 99]},
    ],
)
def test_a_map_that_differs_in_anything_has_another_mask(changes: dict[str, Any]) -> None:
    assert map_of([[0, 100]]).shows_the_same_as(map_of([[0, 100]], stamp_ns=9, revision=8))
    assert not map_of([[0, 100]]).shows_the_same_as(map_of([[0, 100]], **changes))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"cells": [0, 0, 0]}, "map data holds 3 cells, must be width x height = 2 x 1 = 2"),
        ({"width": 3}, "map data holds 2 cells, must be width x height = 3 x 1 = 3"),
        ({"resolution": 0.0}, r"map resolution is 0\.0 m, must be greater than 0"),
        ({"resolution": math.nan}, "map resolution is nan, must be finite"),
        ({"origin_x": math.nan}, "map origin_x is nan, must be finite"),
        ({"origin_y": -math.inf}, "map origin_y is -inf, must be finite"),
        ({"origin_yaw": math.nan}, "map origin_yaw is nan, must be finite"),
        ({"width": -2, "height": -1}, "map is -2 x -1 cells, must not be less than 0"),
        ({"width": 10**6, "height": 10**6}, "map is 1000000 x 1000000 = 1000000000000 cells, the"),
    ],
)
def test_a_malformed_map_is_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        map_of([[0, 0]], **changes)


TAGS = np.array([(1.0, 1.0), (3.0, 2.0)])


def a_map(rows: list[list[int]], resolution: float = 1.0) -> OccupancyMap:
    return map_of(rows, resolution=resolution, origin_x=10.0, origin_y=20.0)


def test_without_a_map_places_are_around_the_tags() -> None:
    places = floor(TAGS, None)
    low, high = TAGS.min(axis=0) - MARGIN_M, TAGS.max(axis=0) + MARGIN_M
    assert ((places > low) & (places < high)).all()
    assert len(places) == 8 * 6
    assert len(floor(TAGS[:1], None)) > 1
    empty = map_of(np.zeros((0, 0)))
    np.testing.assert_array_equal(floor(TAGS, empty), places)


@pytest.mark.parametrize("far", [5000.0, 1.1e6, 1e300, 1.7e308])
def test_a_tag_far_off_adds_no_places(far: float) -> None:
    lost = np.array([(-far, far)])
    np.testing.assert_array_equal(floor(np.vstack((TAGS, TAGS, lost)), None), floor(TAGS, None))
    if far > 1e6:
        assert len(floor(lost, None)) == 0


def test_on_a_map_places_are_free_and_known_cells() -> None:
    places = floor(TAGS, a_map([[0, 100, -1], [49, 50, 10]]))
    assert sorted(map(tuple, places.tolist())) == [(10.5, 20.5), (10.5, 21.5), (12.5, 21.5)]


def test_in_a_large_greenhouse_a_limited_number_of_places_is_spread_out() -> None:
    places = floor(TAGS, a_map([[0] * 1_000] * 500, resolution=0.05))
    assert len(places) == MAX_PLACES
    assert np.ptp(places, axis=0).min() > 20.0
    np.testing.assert_array_equal(places, floor(TAGS, a_map([[0] * 1_000] * 500, resolution=0.05)))


def test_no_place_is_on_a_tag() -> None:
    places = np.array([(1.0, 1.0 + LEAST_APART_M), (1.0, 0.99 + LEAST_APART_M), (2.0, 0.0)])
    assert free_of(TAGS, places).tolist() == [[1.0, 1.5], [2.0, 0.0]]


FLOOR = maps.map_of([[0, 100, -1], [0, 0, 50]], resolution=0.05, origin_x=-1.5, origin_yaw=0.25)
OTHER = maps.map_of([[0, 0]])
TOO_LARGE = maps.map_of(np.zeros((4_001, 4_000), np.int8))


def test_a_map_is_read_back_unchanged() -> None:
    found = read_map(text_of(FLOOR), revision=7)
    assert found.shows_the_same_as(FLOOR)
    assert (found.stamp_ns, found.revision) == (FLOOR.stamp_ns, 7)


def test_a_floor_of_two_hectares_is_a_tenth_of_a_megabyte() -> None:
    rows = np.zeros((2_000, 4_000), np.int8)
    rows[::40] = 100
    rows[:, ::160] = -1
    assert 0 < len(text_of(maps.map_of(rows))) < 100_000


def test_a_map_that_is_too_large_for_a_row_is_not_stored() -> None:
    noise = np.random.default_rng(1).integers(0, 100, (1_200, 1_200))
    assert text_of(maps.map_of(noise)) == ""
    assert text_of(TOO_LARGE) == ""


@pytest.mark.parametrize(
    "changed",
    [
        {"width": 4},
        {"width": 10_000_000, "height": 10_000_000},
        {"width": MAX_PACKED_CELLS, "height": 1},
        {"width": "3"},
        {"resolution": 0.0},
        {"origin_x": None},
        {"cells": "no base64"},
        {"cells": base64.b64encode(b"no zlib").decode()},
        {"cells": base64.b64encode(zlib.compress(bytes(50_000_000))).decode()},
        {"cells": 5},
        {"more": 1},
    ],
)
def test_a_text_that_is_no_map_is_refused(changed: dict[str, object]) -> None:
    text = json.dumps({**json.loads(text_of(FLOOR)), **changed})
    with pytest.raises(ValueError, match=r"."):
        read_map(text, revision=1)
    for other in ("", "[]", "null"):
        with pytest.raises(ValueError, match=r"."):
            read_map(other, revision=1)


def stored_map(path: Path) -> list[tuple[object, ...]]:
    return select(path, "SELECT value FROM meta WHERE key = 'map'")


def test_the_journal_has_the_latest_map_and_none_where_that_is_too_large(tmp_path: Path) -> None:
    path = tmp_path / "journal.sqlite"
    for one in (FLOOR, OTHER, TOO_LARGE):
        journal = Journal(path, "test", LIMITS)
        try:
            journal.begin(CLOCK)
            journal.write_map(one)
            wait_for(lambda it=one: stored_map(path) == [(text_of(it),)], "the map in the file")  # type: ignore[misc]
        finally:
            journal.close()
