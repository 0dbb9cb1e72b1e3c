"""Ways through the aisles and the order of the visits."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from greenhouse_sim.simulator import GreenhouseSimulator

from lupin_patrol.greenhouse import (
    CLEARANCE_M,
    Greenhouse,
    Point,
    Rect,
    Roadmap,
    Table,
    length_of,
    read_greenhouse,
    tour,
    walk,
)
from lupin_patrol.mission import DOCK


@pytest.fixture(scope="module")
def greenhouse() -> Greenhouse:
    return read_greenhouse(GreenhouseSimulator())


@pytest.fixture(scope="module")
def roadmap(greenhouse: Greenhouse) -> Roadmap:
    return Roadmap(greenhouse)


def hall(*tables: Rect) -> Roadmap:
    """A hall of 4 × 4 m."""
    named = tuple(Table(str(index), rect) for index, rect in enumerate(tables))
    return Roadmap(Greenhouse(Rect(0.0, 0.0, 4.0, 4.0), named, ()))


def test_no_way_between_two_stops_enters_a_table_or_its_clearance(
    greenhouse: Greenhouse, roadmap: Roadmap
) -> None:
    stops = [DOCK, *(tag.stop for tag in greenhouse.tags)]
    for a in stops:
        for b in stops:
            way = roadmap.way(a, b)
            assert (way[0], way[-1]) == (a, b)
            positions = [p for p, _ in walk(way, 0.05, length_of(way))]
            assert all(greenhouse.is_free(p) for p in positions), (a, b)


def test_a_way_bends_round_the_nearer_corner() -> None:
    way = hall(Rect(1.0, 1.0, 3.0, 2.0)).way((0.5, 1.2), (3.5, 1.2))
    low = 1.0 - CLEARANCE_M
    np.testing.assert_allclose(way, [(0.5, 1.2), (0.8, low), (3.2, low), (3.5, 1.2)])


def test_a_gap_narrower_than_the_robot_is_no_way() -> None:
    narrow = hall(Rect(1.0, 0.0, 2.0, 1.8), Rect(1.0, 2.19, 2.0, 3.5))
    wide = hall(Rect(1.0, 0.0, 2.0, 1.8), Rect(1.0, 2.21, 2.0, 3.5))
    assert length_of(wide.way((0.5, 2.0), (2.5, 2.0))) == pytest.approx(2.0)
    # The other way round is 0.5 m wide, at the top.
    assert length_of(narrow.way((0.5, 2.0), (2.5, 2.0))) > 4.0


@pytest.mark.parametrize("others", [(), (Rect(1.5, 2.8, 2.5, 3.2),)])
def test_a_place_that_is_walled_off_is_refused(others: tuple[Rect, ...]) -> None:
    walled_off = hall(Rect(0.0, 1.5, 4.0, 2.0), *others)
    with pytest.raises(ValueError, match=r"no way from \(0\.5, 0\.5\) to \(0\.5, 3\.5\) is 0\.4 m"):
        walled_off.way((0.5, 0.5), (0.5, 3.5))


def test_the_tour_is_far_shorter_than_the_list_of_tags(
    greenhouse: Greenhouse, roadmap: Roadmap
) -> None:
    stops = [tag.stop for tag in greenhouse.tags]
    order = tour(roadmap, DOCK, stops)

    def length(places: list[Point]) -> float:
        return sum(length_of(roadmap.way(a, b)) for a, b in pairwise([DOCK, *places, DOCK]))

    assert length([stops[index] for index in order]) < 0.7 * length(stops)
