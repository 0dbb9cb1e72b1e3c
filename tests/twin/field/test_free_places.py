"""Where another tag could stand."""

import numpy as np
import pytest

from lupin_twin.field.explored import (
    LEAST_APART_M,
    MARGIN_M,
    MAX_PLACES,
    OccupancyMap,
    floor,
    free_of,
)
from tests.support.maps import map_of

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
