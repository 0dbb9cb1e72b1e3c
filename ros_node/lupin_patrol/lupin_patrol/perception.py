"""What the robot sees on its way: the list of tags, and the occupancy grid, which both grow.

A tag is discovered when it first comes into view. The grid is row-major with row 0 at the smallest
y, as nav_msgs/OccupancyGrid has it; -1 unknown, 0 free, 100 occupied. The outermost ring of cells
is the greenhouse's wall.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, cos, dist, radians

import numpy as np
from numpy.typing import NDArray

from lupin_patrol.greenhouse import Greenhouse, Point, Tag, crossings
from lupin_patrol.plants import SPECIES, Plants, stream

TAG_RANGE_M = 1.2
# An AprilTag seen at a flatter angle than this is not decoded.
_STEEPEST = cos(radians(70.0))
_GUESSED_RIGHT = 0.9
# The tag stands proud of its table by this much, so the table's own edge does not hide it.
_PROUD_M = 0.01


@dataclass(frozen=True, slots=True)
class Sighting:
    """What perception knows of a tag: where it is, and a first guess at the plant behind it."""

    tag: Tag
    species: str
    species_confidence: float
    anomaly: bool
    sightings: int


class TagDetector:
    """Collects the tags in the order in which they came into view."""

    def __init__(self, greenhouse: Greenhouse, plants: Plants, seed: int) -> None:
        self._greenhouse = greenhouse
        self._tables = [table.rect for table in greenhouse.tables]
        self._plants = plants
        self._seed = seed
        self._guesses: dict[str, tuple[str, float]] = {}
        self._anomalies: dict[str, bool] = {}
        self._counts: dict[str, int] = {}

    def observe_from(self, position: Point, pass_index: int) -> bool:
        """Take one picture all around; returns whether it shows a tag for the first time."""
        found = False
        for tag in self._greenhouse.tags:
            if not self._in_view(tag, position):
                continue
            if tag.tag_id not in self._guesses:
                self._guesses[tag.tag_id] = self._guess(tag)
                self._counts[tag.tag_id] = 0
                found = True
            self._counts[tag.tag_id] += 1
            self._anomalies[tag.tag_id] = self._plants.bugs(tag.tag_id, pass_index) > 0
        return found

    def sightings(self) -> tuple[Sighting, ...]:
        """Return every tag discovered so far, the first one first."""
        return tuple(
            Sighting(
                tag=self._greenhouse.tag(tag_id),
                species=species,
                species_confidence=confidence,
                anomaly=self._anomalies[tag_id],
                sightings=self._counts[tag_id],
            )
            for tag_id, (species, confidence) in self._guesses.items()
        )

    def _in_view(self, tag: Tag, position: Point) -> bool:
        face = (tag.edge[0] + tag.facing[0] * _PROUD_M, tag.edge[1] + tag.facing[1] * _PROUD_M)
        away = dist(face, position)
        if not 0.0 < away <= TAG_RANGE_M:
            return False
        ahead = sum((p - f) * n for p, f, n in zip(position, face, tag.facing, strict=True)) / away
        return ahead >= _STEEPEST and not crossings(position, np.array([face]), self._tables).any()

    def _guess(self, tag: Tag) -> tuple[str, float]:
        chance = stream(self._seed, "guess", tag.tag_id)
        if chance.random() < _GUESSED_RIGHT:
            return self._plants.species(tag.tag_id), chance.uniform(0.55, 0.8)
        return chance.choice(SPECIES), chance.uniform(0.3, 0.5)


RESOLUTION_M = 0.05
VIEW_RADIUS_M = 2.0

UNKNOWN, FREE, OCCUPIED = -1, 0, 100


@dataclass(frozen=True, slots=True)
class Grid:
    """One state of the map: `cells` are int8 bytes, row-major; the origin is cell 0's corner."""

    width: int
    height: int
    resolution_m: float
    origin: Point
    cells: bytes


class Exploration:
    """What the robot has seen of the floor so far. Cells become known and never unknown again."""

    def __init__(self, greenhouse: Greenhouse) -> None:
        self._tables = [table.rect for table in greenhouse.tables]
        inside = greenhouse.interior
        self._origin = (inside.x0 - RESOLUTION_M, inside.y0 - RESOLUTION_M)
        columns, rows = (
            2 + ceil(round(extent / RESOLUTION_M, 6))
            for extent in (inside.x1 - inside.x0, inside.y1 - inside.y0)
        )
        self._shape = (rows, columns)
        row, column = np.divmod(np.arange(rows * columns), columns)
        self._centres = np.column_stack(
            [
                self._origin[0] + (column + 0.5) * RESOLUTION_M,
                self._origin[1] + (row + 0.5) * RESOLUTION_M,
            ]
        )
        # A column for each table: whether it covers the cell.
        x, y = self._centres[:, [0]], self._centres[:, [1]]
        edge = np.array([(t.x0, t.y0, t.x1, t.y1) for t in self._tables]).reshape(-1, 4)
        self._covered = (edge[:, 0] < x) & (x < edge[:, 2]) & (edge[:, 1] < y) & (y < edge[:, 3])
        wall = (row == 0) | (row == rows - 1) | (column == 0) | (column == columns - 1)
        self._truth = np.where(wall | self._covered.any(axis=1), OCCUPIED, FREE).astype(np.int8)
        self._cells = np.full(rows * columns, UNKNOWN, dtype=np.int8)

    def observe_from(self, position: Point) -> bool:
        """Add what is in view from there; returns whether anything was new.

        A cell is in view within VIEW_RADIUS_M unless a table stands before it. A table does not
        hide itself: the camera looks down on it, while the next one hides behind its plants.
        """
        unknown = np.flatnonzero(self._cells == UNKNOWN)
        offset = self._centres[unknown] - np.asarray(position)
        near = unknown[np.hypot(offset[:, 0], offset[:, 1]) <= VIEW_RADIUS_M]
        hidden = crossings(position, self._centres[near], self._tables) & ~self._covered[near]
        seen: NDArray[np.intp] = near[~hidden.any(axis=1)]
        self._cells[seen] = self._truth[seen]
        return seen.size > 0

    def snapshot(self) -> Grid:
        """Return the map as it is now; it does not change any more."""
        rows, columns = self._shape
        return Grid(columns, rows, RESOLUTION_M, self._origin, self._cells.tobytes())
