"""Simulated camera and sensors: plants, pests, climate, and the map of the floor.

Plants and climate follow from the seed, the pass and the time of day, and hold no state. So an
inspection of one tag never depends on the others. Sensors have the units of
`lupin_msgs/SensorReading`: temperature °C, humidity % relative, co2 ppm, light lx, soil_moisture %.

The occupancy grid only grows. It is row-major with row 0 at the smallest y, as in
nav_msgs/OccupancyGrid: -1 unknown, 0 free, 100 occupied. The outermost ring of cells is the
greenhouse's wall.
"""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import ceil, dist
from random import Random
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lupin_patrol.greenhouse import TABLE_HEIGHT_M, Greenhouse, Point, Rect, Tag
from lupin_twin.core.state import Bloom, Flower


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
# Probability of a pest outbreak per pass.
_OUTBREAK = 0.2


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
        """Number of pests at a tag during one pass; the next pass finds them gone.

        The very first pass always has an outbreak, so that a demo shows one.
        """
        chance = stream(self._seed, "outbreak", pass_index)
        breaks_out = chance.random() < _OUTBREAK or pass_index == self._first_pass
        where, bugs = chance.choice(list(self._tags)), chance.randint(3, 12)
        return bugs if breaks_out and where == tag_id else 0

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
            footprint=tuple((x, y, 0.0) for x, y in self._tags[tag_id].table.corners),
        )


def _grow(table: Rect, species: str, seed: int) -> Iterator[Bloom]:
    """Plant a table in rows, spaced wider than the position noise; most plants flower."""
    chance = stream(seed, "grow", table.name)
    columns = max(1, round((table.x1 - table.x0) / _PLANT_SPACING_M))
    rows = max(1, round((table.y1 - table.y0) / _PLANT_SPACING_M))
    for row in range(rows):
        for column in range(columns):
            x = table.x0 + (column + 0.5) * (table.x1 - table.x0) / columns
            y = table.y0 + (row + 0.5) * (table.y1 - table.y0) / rows
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
) -> dict[str, float]:
    """Read sensors at a place (m, map) and time (s since midnight), noise from `chance` included.

    The simulator draws from the global `random`, whose state is therefore replaced.
    """
    random.setstate(chance.getstate())
    return {name: value_of(registry, name, position, time_of_day_s) for name in sensors}


def value_of(registry: Any, sensor: str, position: Point, time_of_day_s: float) -> float:
    """A sensor's value at a place (m, map) and time (s since midnight), in the contract's unit."""
    value = registry.get_sensor(sensor).retrieve_data(position, time_of_day_s % SECONDS_PER_DAY)
    return float(value) * _TO_CONTRACT_UNIT.get(sensor, 1.0)


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
        inside = greenhouse.interior
        self._origin = (inside.x0 - RESOLUTION_M, inside.y0 - RESOLUTION_M)
        columns, rows = (
            2 + ceil(round(extent / RESOLUTION_M, 6))
            for extent in (inside.x1 - inside.x0, inside.y1 - inside.y0)
        )
        row, column = np.mgrid[:rows, :columns]
        self._x = self._origin[0] + (column + 0.5) * RESOLUTION_M
        self._y = self._origin[1] + (row + 0.5) * RESOLUTION_M
        occupied = (row == 0) | (row == rows - 1) | (column == 0) | (column == columns - 1)
        for box in greenhouse.tables:
            inside_x = (box.x0 < self._x) & (self._x < box.x1)
            occupied |= inside_x & (box.y0 < self._y) & (self._y < box.y1)
        self._truth = np.where(occupied, OCCUPIED, FREE).astype(np.int8)
        self._cells = np.full((rows, columns), UNKNOWN, dtype=np.int8)

    def observe_from(self, position: Point) -> bool:
        """Add the cells within VIEW_RADIUS_M of a position; returns whether any of them was new."""
        near = np.hypot(self._x - position[0], self._y - position[1]) <= VIEW_RADIUS_M
        new: NDArray[np.bool_] = near & (self._cells == UNKNOWN)
        self._cells[new] = self._truth[new]
        return bool(new.any())

    def snapshot(self) -> Grid:
        """Return an immutable copy of the current map."""
        rows, columns = self._cells.shape
        return Grid(columns, rows, RESOLUTION_M, self._origin, self._cells.tobytes())
