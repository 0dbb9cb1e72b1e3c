"""Ways through the aisles, and the order in which the tags are visited.

The shortest way between two points among rectangles bends only at their corners (visibility
graph). The tables are grown by the robot's clearance first, so a way never touches one.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from lupin_patrol.geometry import Point, crossings, length_of
from lupin_patrol.house import CLEARANCE_M, House


class Roadmap:
    """Shortest ways between any two free points of a house."""

    def __init__(self, house: House) -> None:
        self._obstacles = [table.rect.grown(CLEARANCE_M) for table in house.tables]
        self._corners = np.array(
            [
                corner
                for obstacle in self._obstacles
                for corner in obstacle.corners
                if house.is_free(corner)
            ]
        ).reshape(-1, 2)
        self._length, self._next = self._shortest_between_corners()

    def way(self, start: Point, goal: Point) -> list[Point]:
        """Return the shortest way as a polyline from start to goal, both included.

        Raises ValueError when no way leads there.
        """
        if not crossings(start, np.array([goal]), self._obstacles).any():
            return [start, goal]
        total = (
            self._straight(start)[:, np.newaxis] + self._length + self._straight(goal)[np.newaxis]
        )
        if not np.isfinite(total).any():
            raise ValueError(f"no way from {start} to {goal} is {2 * CLEARANCE_M} m wide")
        first, last = np.unravel_index(np.argmin(total), total.shape)
        corner, bends = int(first), []
        while corner != last:
            bends.append(corner)
            corner = int(self._next[corner, last])
        bends.append(corner)
        return [start, *((float(x), float(y)) for x, y in self._corners[bends]), goal]

    def _straight(self, point: Point) -> NDArray[np.float64]:
        """Distance from a point to each corner in a straight line, infinite where one is hidden."""
        away: NDArray[np.float64] = np.hypot(*(self._corners - np.asarray(point)).T)
        away[crossings(point, self._corners, self._obstacles).any(axis=1)] = np.inf
        return away

    def _shortest_between_corners(self) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
        """Floyd and Warshall: lengths between all corners, and the next corner on each way."""
        count = len(self._corners)
        length = np.array([self._straight((x, y)) for x, y in self._corners]).reshape(count, count)
        following = np.tile(np.arange(count), (count, 1))
        for via in range(count):
            detour = length[:, [via]] + length[[via], :]
            shorter = detour < length
            length = np.where(shorter, detour, length)
            following = np.where(shorter, following[:, [via]], following)
        return length, following


def tour(roadmap: Roadmap, start: Point, stops: Sequence[Point]) -> list[int]:
    """Order the stops into a short round trip from `start`; returns their indices.

    Nearest neighbour, then 2-opt until nothing gets shorter: for some dozens of stops that is
    within a few percent of the best and takes milliseconds.
    """
    places = [start, *stops]
    length = np.array([[length_of(roadmap.way(a, b)) for b in places] for a in places])
    order, left = [0], set(range(1, len(places)))
    while left:
        nearest = min(left, key=lambda place: (length[order[-1], place], place))
        order.append(nearest)
        left.remove(nearest)
    order.append(0)
    while _untangle(order, length):
        pass
    return [place - 1 for place in order[1:-1]]


def _untangle(order: list[int], length: NDArray[np.float64]) -> bool:
    """Reverse the first stretch of the round trip whose reversal makes it shorter."""
    for i in range(1, len(order) - 2):
        for j in range(i + 1, len(order) - 1):
            before, first, last, after = order[i - 1], order[i], order[j], order[j + 1]
            gain = (
                length[before, first]
                + length[last, after]
                - length[before, last]
                - length[first, after]
            )
            if gain > 1e-9:
                order[i : j + 1] = order[i : j + 1][::-1]
                return True
    return False
