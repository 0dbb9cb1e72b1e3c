"""Simulated camera and sensors: plants, pests, climate, and the map of the floor.

Plants and climate follow from the seed, the pass and the time of day, and hold no state. So an
inspection of one tag never depends on the others. Sensors have the units of
`lupin_msgs/SensorReading`: temperature °C, humidity % relative, co2 ppm, light lx, soil_moisture %.

The map is row-major with row 0 at the smallest y, as in nav_msgs/OccupancyGrid: 0 free, 100
occupied. The outermost ring of cells is the greenhouse's wall.
"""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import ceil, dist
from random import Random
from typing import Any

import numpy as np

from lupin_patrol.greenhouse import TABLE_HEIGHT_M, Greenhouse, Point, Table, Tag
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
_OFF_GRID_M = 0.01
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
        """Inspect the plants of a tag."""
        chance = stream(self._seed, "look", tag_id, pass_index, attempt)
        bugs = self.bugs(tag_id, pass_index)
        blooms = self._blooms[tag_id]
        infested = set(chance.sample(range(len(blooms)), min(len(blooms), bugs, 3)))
        seen = tuple(
            replace(bloom, confidence=chance.uniform(0.72, 0.99), anomaly=index in infested)
            for index, bloom in enumerate(blooms)
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
    """Plant a table in rows that are not quite straight; most plants flower."""
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
                x, y = (at + chance.uniform(-_OFF_GRID_M, _OFF_GRID_M) for at in (x, y))
                z = TABLE_HEIGHT_M + height_m
                yield Bloom(x, y, z, height_m, species, 1.0, anomaly=False)


def _nearest(tags: list[Tag], position: Point) -> Tag:
    return min(tags, key=lambda tag: dist(tag.position, position))


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


RESOLUTION_M = 0.05
FREE, OCCUPIED = 0, 100


@dataclass(frozen=True, slots=True)
class Grid:
    """The map: `cells` are int8 bytes, row-major; the origin is cell 0's corner."""

    width: int
    height: int
    resolution_m: float
    origin: Point
    cells: bytes


def floor_map(greenhouse: Greenhouse) -> Grid:
    """The complete map, as a robot has it that has patrolled for days."""
    inside = greenhouse.interior
    origin = (inside.x0 - RESOLUTION_M, inside.y0 - RESOLUTION_M)
    columns, rows = (
        2 + ceil(round(extent / RESOLUTION_M, 6))
        for extent in (inside.x1 - inside.x0, inside.y1 - inside.y0)
    )
    row, column = np.mgrid[:rows, :columns]
    x, y = (origin[i] + (n + 0.5) * RESOLUTION_M for i, n in enumerate((column, row)))
    occupied = (row == 0) | (row == rows - 1) | (column == 0) | (column == columns - 1)
    for box in (table.rect for table in greenhouse.tables):
        occupied |= (box.x0 < x) & (x < box.x1) & (box.y0 < y) & (y < box.y1)
    cells = np.where(occupied, OCCUPIED, FREE).astype(np.int8)
    return Grid(columns, rows, RESOLUTION_M, origin, cells.tobytes())
