"""Rectangles and lines of sight on the floor plan (metres, map frame: x right, y up)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import dist

import numpy as np
from numpy.typing import NDArray

Point = tuple[float, float]

# Touching an edge is not crossing it: a robot slides along a table at its clearance, and the
# camera sees along a table's side. One micrometre is far above float noise.
TOUCH_M = 1e-6


@dataclass(frozen=True, slots=True)
class Rect:
    """Axis-aligned rectangle, x0 < x1 and y0 < y1, metres."""

    x0: float
    y0: float
    x1: float
    y1: float

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


def walk(points: Sequence[Point], step_m: float, length_m: float) -> Iterator[tuple[Point, float]]:
    """Yield positions along a polyline and the way since the last one, at most `step_m` apart.

    Ends after `length_m`, or at the polyline's end if that comes first; yields at least one.
    """
    remaining = min(length_m, length_of(points))
    position, ahead = points[0], list(points[1:])
    while True:
        wanted = covered = min(step_m, max(remaining, 0.0))
        while ahead and wanted >= dist(position, ahead[0]):
            wanted -= dist(position, ahead[0])
            position = ahead.pop(0)
        if ahead and wanted > 0.0:
            part = wanted / dist(position, ahead[0])
            position = (
                position[0] + part * (ahead[0][0] - position[0]),
                position[1] + part * (ahead[0][1] - position[1]),
            )
        remaining -= covered
        yield position, covered
        if remaining <= TOUCH_M:
            return
