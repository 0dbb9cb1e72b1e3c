"""Floor plan of the simulated greenhouse (walls, planter tables, tags) and paths through it.

Read from the simulator's own configuration. Metres, map frame. The origin is the corner of the
greenhouse inside the walls; x runs along the short side (right), y along the long side (up). The
shortest path among rectangles bends only at their corners (visibility graph). The tables are
first grown by the robot's clearance, so a path never touches one.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from heapq import heappop, heappush
from itertools import accumulate, pairwise
from math import atan2, dist
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Point = tuple[float, float]

# Touching an edge is not crossing it: a robot slides along a table at its clearance. One micrometre
# is far above float noise.
TOUCH_M = 1e-6


@dataclass(frozen=True, slots=True)
class Rect:
    """Axis-aligned rectangle, x0 < x1 and y0 < y1, metres. A table has a name."""

    x0: float
    y0: float
    x1: float
    y1: float
    name: str = ""

    def grown(self, margin_m: float) -> Rect:
        """Return the rectangle widened by a margin on every side; a negative one shrinks it."""
        return Rect(self.x0 - margin_m, self.y0 - margin_m, self.x1 + margin_m, self.y1 + margin_m)

    def contains(self, point: Point) -> bool:
        """Whether the point lies inside, the edges excluded."""
        x, y = point
        return (
            self.x0 + TOUCH_M < x < self.x1 - TOUCH_M and self.y0 + TOUCH_M < y < self.y1 - TOUCH_M
        )

    def nearest(self, point: Point) -> Point:
        """Return the point of the rectangle (edges included) that is nearest to the given one."""
        return (
            min(max(point[0], self.x0), self.x1),
            min(max(point[1], self.y0), self.y1),
        )

    @property
    def corners(self) -> tuple[Point, Point, Point, Point]:
        """The four corners, counter-clockwise from (x0, y0)."""
        return (self.x0, self.y0), (self.x1, self.y0), (self.x1, self.y1), (self.x0, self.y1)


def crossings(
    origin: Point, targets: NDArray[np.float64], rects: Sequence[Rect]
) -> NDArray[np.bool_]:
    """Tell which straight lines from `origin` to the targets pass through which rectangles.

    `targets` has shape (n, 2); the result has shape (n, len(rects)). The slab method (Kay and
    Kajiya, 1986): a line is inside a rectangle where it is between both pairs of edges at once.
    """
    edges = np.array(
        [(r.x0, r.y0, r.x1, r.y1) for r in (rect.grown(-TOUCH_M) for rect in rects)],
        dtype=np.float64,
    ).reshape(-1, 4)
    start = np.asarray(origin, dtype=np.float64)
    step = targets - start
    # A line parallel to an edge gets a quotient of ±infinity, which is what the method needs;
    # only 0/0 has to be kept out.
    step = np.where(step == 0.0, 1e-300, step)[:, np.newaxis, :]
    with np.errstate(over="ignore"):
        low = (edges[:, :2] - start) / step
        high = (edges[:, 2:] - start) / step
    enter = np.minimum(low, high).max(axis=2)
    leave = np.maximum(low, high).min(axis=2)
    crossed: NDArray[np.bool_] = np.maximum(enter, 0.0) < np.minimum(leave, 1.0)
    return crossed


def length_of(points: Sequence[Point]) -> float:
    """Length of a polyline, m."""
    return sum(dist(a, b) for a, b in pairwise(points))


def walk(points: Sequence[Point], step_m: float) -> Iterator[tuple[Point, float]]:
    """Yield positions along a polyline, each with its distance from the last, at most `step_m`.

    The last one is the polyline's end.
    """
    along_m = [0.0, *accumulate(dist(a, b) for a, b in pairwise(points))]
    at_m = 0.0
    while True:
        before_m, at_m = at_m, min(at_m + step_m, along_m[-1])
        x, y = (float(np.interp(at_m, along_m, axis)) for axis in zip(*points, strict=True))
        yield (x, y), at_m - before_m
        if along_m[-1] - at_m <= TOUCH_M:
            return


# The robot's centre keeps this far from tables and walls: half its width of 0.3 m, plus a margin.
# The narrowest aisle of the default greenhouse is 0.45 m.
CLEARANCE_M = 0.2
# Distances from the table's edge at which the robot's centre may stop to read a tag. The farthest
# that fits into the aisle is used, because the camera then sees the whole planter.
STAND_OFFS_M = (0.4, 0.35, 0.3, 0.25, 0.2)

# Heights above the floor: the soil in the planters, and the tags on the tables' edges.
TABLE_HEIGHT_M = 0.35
TAG_HEIGHT_M = 0.3


@dataclass(frozen=True, slots=True)
class Tag:
    """An AprilTag with its climate sensors.

    `edge` is the point of the table's outline nearest to the tag. `facing` is the unit vector from
    there into the aisle. `stop` is where the robot's centre stands to read the tag.
    """

    tag_id: str
    position: Point
    sensors: tuple[str, ...]
    table: Rect
    edge: Point
    facing: Point
    stop: Point

    @property
    def yaw(self) -> float:
        """Direction of `facing`, rad from x towards y."""
        return atan2(self.facing[1], self.facing[0])


@dataclass(frozen=True, slots=True)
class Greenhouse:
    """The static layout: interior, tables and tags."""

    interior: Rect
    tables: tuple[Rect, ...]
    tags: tuple[Tag, ...]

    def is_free(self, point: Point) -> bool:
        """Whether the robot's centre may be there."""
        floor = self.interior.grown(TOUCH_M - CLEARANCE_M)
        return floor.nearest(point) == point and not any(
            table.grown(CLEARANCE_M).contains(point) for table in self.tables
        )


def read_greenhouse(simulator: Any) -> Greenhouse:
    """Read the layout of a `greenhouse_sim.simulator.GreenhouseSimulator`.

    Raises ValueError when a tag has no aisle that the robot fits into.
    """
    size = simulator.sim_config["visualization"]
    interior = Rect(0.0, 0.0, float(size["greenhouse_width_m"]), float(size["greenhouse_height_m"]))
    # The simulator's tag manager drops the tables when it loads this file.
    layout = json.loads(Path(simulator.tag_manager.file_path).read_text(encoding="utf-8"))
    tables = tuple(
        Rect(float(box["x0"]), float(box["y0"]), float(box["x1"]), float(box["y1"]), name)
        for name, box in layout["tables"].items()
    )
    greenhouse = Greenhouse(interior, tables, ())
    tags = (
        _place_tag(tag_id, (float(tag["x"]), float(tag["y"])), tag["sensors"], greenhouse)
        for tag_id, tag in simulator.tag_manager.get_tags().items()
    )
    return replace(greenhouse, tags=tuple(tags))


def _place_tag(tag_id: str, position: Point, sensors: list[str], greenhouse: Greenhouse) -> Tag:
    """Put a tag on the nearest side of its table; at a corner, on the side with the wider aisle."""
    table = min(greenhouse.tables, key=lambda it: dist(position, it.nearest(position)))
    sides = []
    for order, (edge, facing) in enumerate(_sides(table, position)):
        for stand_off_m in STAND_OFFS_M:
            stop = (edge[0] + facing[0] * stand_off_m, edge[1] + facing[1] * stand_off_m)
            if greenhouse.is_free(stop):
                away_m = round(dist(position, edge), 3)
                sides.append((away_m, -stand_off_m, order, edge, facing, stop))
                break
    if not sides:
        raise ValueError(
            f"tag {tag_id} at {position}: no aisle beside {table.name} is as wide as"
            f" {2 * CLEARANCE_M} m"
        )
    *_, edge, facing, stop = min(sides)
    return Tag(tag_id, position, tuple(sensors), table, edge, facing, stop)


def _sides(rect: Rect, position: Point) -> list[tuple[Point, Point]]:
    """For each side of a table: its point nearest to the tag, and its outward normal."""
    x, y = rect.nearest(position)
    return [
        ((rect.x0, y), (-1.0, 0.0)),
        ((rect.x1, y), (1.0, 0.0)),
        ((x, rect.y0), (0.0, -1.0)),
        ((x, rect.y1), (0.0, 1.0)),
    ]


class Roadmap:
    """Shortest paths between any two free points of a greenhouse."""

    def __init__(self, greenhouse: Greenhouse) -> None:
        self._obstacles = [table.grown(CLEARANCE_M) for table in greenhouse.tables]
        corners = (corner for obstacle in self._obstacles for corner in obstacle.corners)
        self._corners = np.array(list(filter(greenhouse.is_free, corners))).reshape(-1, 2)
        self._seen = {corner: self._seen_from(corner) for corner in _points(self._corners)}

    def way(self, start: Point, goal: Point) -> list[Point]:
        """Return the shortest path (Dijkstra, 1959) as a polyline, from start to goal inclusive.

        Raises ValueError when there is no path.
        """
        if not crossings(start, np.array([goal]), self._obstacles).any():
            return [start, goal]
        seen, before_goal = {**self._seen, start: self._seen_from(start)}, self._seen_from(goal)
        ahead, reached = [(0.0, [start])], set()
        while ahead:
            length_m, way = heappop(ahead)
            here = way[-1]
            if here == goal:
                return way
            if here in reached:
                continue
            reached.add(here)
            for there in (*seen[here], *([goal] if here in before_goal else ())):
                heappush(ahead, (length_m + dist(here, there), [*way, there]))
        raise ValueError(f"no way from {start} to {goal} is {2 * CLEARANCE_M} m wide")

    def _seen_from(self, point: Point) -> list[Point]:
        """The corners to which the way from a point is straight."""
        hidden = crossings(point, self._corners, self._obstacles).any(axis=1)
        return _points(self._corners[~hidden])


def _points(rows: NDArray[np.float64]) -> list[Point]:
    return [(x, y) for x, y in rows.tolist()]


def tour(roadmap: Roadmap, start: Point, stops: Sequence[Point]) -> list[int]:
    """Order the stops into a round trip from `start`, always to the nearest; returns indices."""
    order, left, position = [], set(range(len(stops))), start
    while left:
        ways = {index: length_of(roadmap.way(position, stops[index])) for index in left}
        nearest = min(left, key=lambda index: (ways[index], index))
        order.append(nearest)
        left.remove(nearest)
        position = stops[nearest]
    return order
