"""Rectangles and lines of sight on the floor plan."""

from __future__ import annotations

from itertools import pairwise
from math import dist

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from lupin_patrol.greenhouse import Point, Rect, crossings, length_of, walk

BOX = Rect(1.0, 2.0, 3.0, 4.0)

coordinate = st.floats(0.0, 5.0).map(lambda value: round(value, 3))
point = st.tuples(coordinate, coordinate)


def crosses(start: Point, goal: Point, rect: Rect = BOX) -> bool:
    return bool(crossings(start, np.array([goal]), [rect])[0, 0])


def test_a_rectangle_grows_and_shrinks_on_every_side() -> None:
    assert BOX.grown(0.5) == Rect(0.5, 1.5, 3.5, 4.5)
    assert BOX.grown(0.5).grown(-0.5) == BOX


def test_a_rectangle_contains_its_inside_without_its_edges() -> None:
    assert BOX.contains((2.0, 3.0))
    for outside in ((1.0, 3.0), (3.0, 3.0), (2.0, 2.0), (2.0, 4.0), (0.0, 3.0), (2.0, 5.0)):
        assert not BOX.contains(outside)


def test_the_nearest_point_is_on_the_edge_for_points_outside_and_itself_inside() -> None:
    assert BOX.nearest((0.0, 3.0)) == (1.0, 3.0)
    assert BOX.nearest((9.0, 9.0)) == (3.0, 4.0)
    assert BOX.nearest((2.0, 2.5)) == (2.0, 2.5)


def test_corners_go_round_counter_clockwise() -> None:
    corners = BOX.corners
    area = sum(a[0] * b[1] - b[0] * a[1] for a, b in pairwise([*corners, corners[0]])) / 2
    assert area == pytest.approx(4.0)


@pytest.mark.parametrize(
    ("start", "goal", "expected"),
    [
        ((0.0, 3.0), (5.0, 3.0), True),  # parallel to an edge, through the middle
        ((2.0, 0.0), (2.0, 5.0), True),
        ((0.0, 0.0), (5.0, 5.0), True),
        ((2.0, 3.0), (5.0, 5.0), True),  # starts inside
        ((0.0, 3.0), (2.0, 3.0), True),  # ends inside
        ((0.0, 3.0), (0.5, 3.0), False),  # ends before
        ((4.0, 3.0), (5.0, 3.0), False),  # starts behind
        ((0.0, 1.0), (5.0, 1.0), False),  # passes below
        ((0.0, 2.0), (5.0, 2.0), False),  # slides along the lower edge
        ((1.0, 0.0), (1.0, 5.0), False),  # slides along the left edge
        ((0.0, 1.0), (2.0, 3.0), True),  # enters through the corner (1, 2)
        ((0.0, 3.0), (2.0, 1.0), False),  # touches the corner (1, 2)
    ],
)
def test_a_line_crosses_a_rectangle_when_it_goes_through_its_inside(
    start: Point, goal: Point, expected: bool
) -> None:
    assert crosses(start, goal) is expected
    assert crosses(goal, start) is expected


@given(start=point, goal=point)
def test_crossing_agrees_with_stepping_along_the_line(start: Point, goal: Point) -> None:
    steps = np.linspace(0.0, 1.0, 400)
    line = [
        (start[0] + t * (goal[0] - start[0]), start[1] + t * (goal[1] - start[1])) for t in steps
    ]
    surely_inside = any(BOX.grown(-0.01).contains(p) for p in line)
    surely_outside = not any(BOX.grown(0.02).contains(p) for p in line)
    assume(surely_inside or surely_outside)
    assert crosses(start, goal) is surely_inside


def test_crossings_has_a_row_for_each_target_and_a_column_for_each_rectangle() -> None:
    targets = np.array([(5.0, 3.0), (0.0, 5.0), (5.0, 0.5)])
    crossed = crossings((0.0, 3.0), targets, [BOX, Rect(4.0, 0.0, 4.5, 5.0)])
    assert crossed.tolist() == [[True, True], [False, False], [True, True]]
    assert crossings((0.0, 3.0), targets, []).shape == (3, 0)


def test_the_length_of_a_polyline() -> None:
    assert length_of([(0.0, 0.0), (3.0, 4.0), (3.0, 5.0)]) == pytest.approx(6.0)
    assert length_of([(1.0, 1.0)]) == 0.0


@given(
    points=st.lists(point, min_size=1, max_size=6),
    step_m=st.floats(0.05, 2.0),
    share=st.floats(0.0, 1.5),
)
def test_a_walk_covers_its_length_in_steps_no_longer_than_asked(
    points: list[Point], step_m: float, share: float
) -> None:
    whole = length_of(points)
    wanted = share * whole
    covered, last = 0.0, points[0]
    for position, way in walk(points, step_m, wanted):
        assert way <= step_m + 1e-9
        assert dist(last, position) <= way + 1e-9
        covered, last = covered + way, position
    assert covered == pytest.approx(min(wanted, whole), abs=1e-5)
    if share >= 1.0:
        assert last == pytest.approx(points[-1], abs=1e-5)


def test_a_walk_follows_its_polyline_round_the_corner() -> None:
    positions = [p for p, _ in walk([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)], 0.5, 1.75)]
    np.testing.assert_allclose(positions, [(0.5, 0.0), (1.0, 0.0), (1.0, 0.5), (1.0, 0.75)])


def test_a_walk_of_no_length_yields_where_it_stands() -> None:
    assert list(walk([(1.0, 2.0), (1.0, 2.0)], 0.2, 5.0)) == [((1.0, 2.0), 0.0)]
