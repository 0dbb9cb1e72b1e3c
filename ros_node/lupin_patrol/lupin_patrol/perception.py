"""Simulated camera and sensors: plants, pests, climate, tags, and the map of the floor.

Plants and climate follow from the seed, the pass and the time of day, and hold no state. So an
inspection of one tag never depends on the others. Sensors have the units of
`lupin_msgs/SensorReading`: temperature °C, humidity % relative, co2 ppm, light lx, soil_moisture %.

The list of tags and the occupancy grid only grow. A tag is discovered when it first comes into
view. The grid is row-major with row 0 at the smallest y, as in nav_msgs/OccupancyGrid: -1 unknown,
0 free, 100 occupied. The outermost ring of cells is the greenhouse's wall.
"""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import ceil, cos, dist, radians
from random import Random
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lupin_patrol.greenhouse import TABLE_HEIGHT_M, Greenhouse, Point, Table, Tag, crossings
from lupin_twin.core.state import Bloom, Flower, Reading


def stream(seed: int, *occasion: str | int) -> random.Random:
    """Return the random stream of one occasion, such as `stream(seed, "look", tag_id, pass)`.

    The same seed and occasion give the same numbers in every process, whatever was drawn before.
    So an event does not depend on the order in which the others were generated. The standard
    library hashes a text seed with SHA-512, not with the process's randomised `hash`.
    """
    text = "/".join(str(part) for part in (seed, *occasion))
    return random.Random(text)  # noqa: S311  # a simulation, not a secret


SPECIES = ("lupin", "tulip", "gerbera", "orchid", "rose")

_PLANT_SPACING_M = 0.09
_IN_FLOWER = 0.75
_POSITION_NOISE_M = 0.01
_OVERLOOKED = 0.06
# Probability of a pest outbreak per pass, and its longest duration in passes.
_OUTBREAK = 0.2
_LONGEST_OUTBREAK = 2


class Plants:
    """All plants of a greenhouse. Each table grows one species; a bloom belongs to one tag."""

    def __init__(self, greenhouse: Greenhouse, seed: int, first_pass: int = 0) -> None:
        self._seed = seed
        self._first_pass = first_pass
        self._tags = {tag.tag_id: tag for tag in greenhouse.tags}
        self._blooms: dict[str, list[Bloom]] = {tag_id: [] for tag_id in self._tags}
        for table in greenhouse.tables:
            tags = [tag for tag in greenhouse.tags if tag.table == table]
            for bloom in _grow(table, self.species(tags[0].tag_id), seed) if tags else ():
                self._blooms[_nearest(tags, (bloom.x, bloom.y)).tag_id].append(bloom)

    def species(self, tag_id: str) -> str:
        """Return the species that grows at a tag."""
        return stream(self._seed, "species", self._tags[tag_id].table.name).choice(SPECIES)

    def bugs(self, tag_id: str, pass_index: int) -> int:
        """Number of pests at a tag during one pass.

        An outbreak begins in one pass at one tag, shrinks, and is gone after at most
        _LONGEST_OUTBREAK passes. The very first pass always has one, so that a demo shows it.
        """
        bugs = 0
        for start in range(
            max(self._first_pass, pass_index - _LONGEST_OUTBREAK + 1), pass_index + 1
        ):
            chance = stream(self._seed, "outbreak", start)
            breaks_out = chance.random() < _OUTBREAK or start == self._first_pass
            where = chance.choice(list(self._tags))
            passes = chance.randint(1, _LONGEST_OUTBREAK)
            at_first = chance.randint(3, 12)
            if breaks_out and where == tag_id and pass_index < start + passes:
                bugs = max(bugs, at_first // (1 + pass_index - start))
        return bugs

    def inspect(self, tag_id: str, pass_index: int, attempt: int) -> Flower:
        """Inspect the plants of a tag: some flowers are missed, the others are located to 1 cm."""
        chance = stream(self._seed, "look", tag_id, pass_index, attempt)
        bugs = self.bugs(tag_id, pass_index)
        blooms = self._blooms[tag_id]
        infested = set(chance.sample(range(len(blooms)), min(len(blooms), bugs, 3)))
        seen = tuple(
            replace(
                _jittered(bloom, chance),
                confidence=chance.uniform(0.72, 0.99),
                anomaly=index in infested,
            )
            for index, bloom in enumerate(blooms)
            if index in infested or chance.random() > _OVERLOOKED
        )
        return Flower(
            species=self.species(tag_id),
            confidence=chance.uniform(0.8, 0.99),
            anomaly=bugs > 0,
            flower_count=len(seen),
            bug_count=bugs,
            blooms=seen,
            footprint=tuple((x, y, 0.0) for x, y in self._tags[tag_id].table.rect.corners),
        )


def _grow(table: Table, species: str, seed: int) -> Iterator[Bloom]:
    """Plant a table in rows, spaced wider than the position noise; most plants flower."""
    chance = stream(seed, "grow", table.name)
    rect = table.rect
    columns = max(1, round((rect.x1 - rect.x0) / _PLANT_SPACING_M))
    rows = max(1, round((rect.y1 - rect.y0) / _PLANT_SPACING_M))
    for row in range(rows):
        for column in range(columns):
            x = rect.x0 + (column + 0.5) * (rect.x1 - rect.x0) / columns
            y = rect.y0 + (row + 0.5) * (rect.y1 - rect.y0) / rows
            height_m = chance.uniform(0.12, 0.38)
            if chance.random() < _IN_FLOWER:
                z = TABLE_HEIGHT_M + height_m
                yield _jittered(Bloom(x, y, z, height_m, species, 1.0, anomaly=False), chance)


def _nearest(tags: list[Tag], position: Point) -> Tag:
    return min(tags, key=lambda tag: dist(tag.position, position))


def _jittered(bloom: Bloom, chance: Random) -> Bloom:
    noise = _POSITION_NOISE_M
    x, y = (at + chance.uniform(-noise, noise) for at in (bloom.x, bloom.y))
    return replace(bloom, x=x, y=y)


SECONDS_PER_DAY = 86_400.0

# The simulator gives soil moisture as a fraction, everything else in the contract's unit.
_TO_CONTRACT_UNIT = {"soil_moisture": 100.0}


def readings_at(
    registry: Any, sensors: Sequence[str], position: Point, time_of_day_s: float, chance: Random
) -> tuple[Reading, ...]:
    """Read sensors at a place (m, map) and time (s since midnight), noise from `chance` included.

    The simulator draws from the global `random`, whose state is therefore replaced.
    """
    random.setstate(chance.getstate())
    return tuple(
        Reading(name, value_of(registry, name, position, time_of_day_s)) for name in sensors
    )


def value_of(registry: Any, sensor: str, position: Point, time_of_day_s: float) -> float:
    """A sensor's value at a place (m, map) and time (s since midnight), in the contract's unit."""
    value = registry.get_sensor(sensor).retrieve_data(position, time_of_day_s % SECONDS_PER_DAY)
    return float(value) * _TO_CONTRACT_UNIT.get(sensor, 1.0)


TAG_RANGE_M = 1.2
# An AprilTag is not decoded when seen at more than 70° from its normal.
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
    anomaly: bool = False
    sightings: int = 0


class TagDetector:
    """Collects the tags in the order in which they came into view."""

    def __init__(self, greenhouse: Greenhouse, plants: Plants, seed: int) -> None:
        self._greenhouse = greenhouse
        self._tables = [table.rect for table in greenhouse.tables]
        self._plants = plants
        self._seed = seed
        self._seen: dict[str, Sighting] = {}

    def observe_from(self, position: Point, pass_index: int) -> bool:
        """Take one picture all around; returns whether it shows a tag for the first time."""
        before = len(self._seen)
        for tag in self._greenhouse.tags:
            if self._in_view(tag, position):
                known = self._seen.get(tag.tag_id) or Sighting(tag, *self._guess(tag))
                self._seen[tag.tag_id] = replace(
                    known,
                    anomaly=self._plants.bugs(tag.tag_id, pass_index) > 0,
                    sightings=known.sightings + 1,
                )
        return len(self._seen) > before

    def sightings(self) -> tuple[Sighting, ...]:
        """Return every tag discovered so far, the first one first."""
        return tuple(self._seen.values())

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
        """Add the cells in view from a position; returns whether any of them was new.

        A cell is in view within VIEW_RADIUS_M unless a table hides it. A table does not hide its
        own cells, because the camera looks down on it; its plants hide the table behind it.
        """
        unknown = np.flatnonzero(self._cells == UNKNOWN)
        offset = self._centres[unknown] - np.asarray(position)
        near = unknown[np.hypot(offset[:, 0], offset[:, 1]) <= VIEW_RADIUS_M]
        hidden = crossings(position, self._centres[near], self._tables) & ~self._covered[near]
        seen: NDArray[np.intp] = near[~hidden.any(axis=1)]
        self._cells[seen] = self._truth[seen]
        return seen.size > 0

    def snapshot(self) -> Grid:
        """Return an immutable copy of the current map."""
        rows, columns = self._shape
        return Grid(columns, rows, RESOLUTION_M, self._origin, self._cells.tobytes())
