"""The plants on the tables, their pests and the climate: what camera and sensors measure at tags.

Everything is a function of the seed: nothing here changes while the patrol runs, so an inspection
of one tag never depends on the others. Sensors have the units of `lupin_msgs/SensorReading`:
temperature °C, humidity % relative, co2 ppm, light lx, soil_moisture %.
"""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from math import dist
from random import Random
from typing import Any

from lupin_patrol.greenhouse import TABLE_HEIGHT_M, Greenhouse, Point, Table, Tag
from lupin_twin.core.state import Bloom, Flower


def stream(seed: int, *occasion: str | int) -> random.Random:
    """Return the random stream of one occasion, such as `stream(seed, "look", tag_id, pass)`.

    The same seed and occasion give the same numbers in every process, whatever was drawn
    elsewhere before: an event does not depend on the order in which the others were made.
    A text as seed is hashed with SHA-512 by the standard library, not by the process's `hash`.
    """
    text = "/".join(str(part) for part in (seed, *occasion))
    return random.Random(text)  # noqa: S311  # a simulation, not a secret


SPECIES = ("lupin", "tulip", "gerbera", "orchid", "rose")

_PLANT_SPACING_M = 0.09
_IN_FLOWER = 0.75
_POSITION_NOISE_M = 0.01
_OVERLOOKED = 0.06
# How likely a pest breaks out in a pass, and after how many passes at most it is gone.
_OUTBREAK = 0.2
_LONGEST_OUTBREAK = 2


class Plants:
    """All plants of a greenhouse. Each table grows one species; a bloom belongs to one tag."""

    def __init__(self, greenhouse: Greenhouse, seed: int, first_pass: int = 0) -> None:
        self._seed = seed
        self._first_pass = first_pass
        self._tag_ids = [tag.tag_id for tag in greenhouse.tags]
        self._boxes = {
            tag.tag_id: tuple((x, y, 0.0) for x, y in tag.table.rect.corners)
            for tag in greenhouse.tags
        }
        self._blooms: dict[str, list[Bloom]] = {tag_id: [] for tag_id in self._tag_ids}
        self._species: dict[str, str] = {}
        for table in greenhouse.tables:
            tags = [tag for tag in greenhouse.tags if tag.table == table]
            species = stream(seed, "species", table.name).choice(SPECIES)
            for tag in tags:
                self._species[tag.tag_id] = species
            for bloom in _grow(table, species, seed) if tags else ():
                self._blooms[_nearest(tags, (bloom.x, bloom.y)).tag_id].append(bloom)

    def species(self, tag_id: str) -> str:
        """Return what grows at a tag."""
        return self._species[tag_id]

    def bugs(self, tag_id: str, pass_index: int) -> int:
        """How many pests sit at a tag during one pass; 0: none.

        A pest breaks out in one pass at one tag, gets fewer, and is gone after at most
        _LONGEST_OUTBREAK passes. There is one in the very first pass, so that a demo shows it.
        """
        bugs = 0
        for start in range(
            max(self._first_pass, pass_index - _LONGEST_OUTBREAK + 1), pass_index + 1
        ):
            chance = stream(self._seed, "outbreak", start)
            breaks_out = chance.random() < _OUTBREAK or start == self._first_pass
            where = chance.choice(self._tag_ids)
            passes = chance.randint(1, _LONGEST_OUTBREAK)
            at_first = chance.randint(3, 12)
            if breaks_out and where == tag_id and pass_index < start + passes:
                bugs = max(bugs, at_first // (1 + pass_index - start))
        return bugs

    def inspect(self, tag_id: str, pass_index: int, attempt: int) -> Flower:
        """Look at the plants of a tag: some flowers are overlooked, the others placed to 1 cm."""
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
            footprint=self._boxes[tag_id],
        )


def _grow(table: Table, species: str, seed: int) -> Iterator[Bloom]:
    """Plant a table in rows that leave room for the looks' noise, and let most plants flower."""
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


class Climate:
    """The climate of one greenhouse, anywhere on its floor and at any time of day."""

    def __init__(self, simulator: Any) -> None:
        self._registry = simulator.sensor_registry

    def read(
        self,
        sensors: Sequence[str],
        position: Point,
        time_of_day_s: float,
        chance: random.Random,
    ) -> tuple[tuple[str, float], ...]:
        """Read sensors at a place (m, map) and time (s since midnight), noise included."""
        with _as_global_random(chance):
            return tuple(
                (name, value_of(self._registry, name, position, time_of_day_s)) for name in sensors
            )


def value_of(registry: Any, sensor: str, position: Point, time_of_day_s: float) -> float:
    """A sensor's value at a place (m, map) and time (s since midnight), in the contract's unit."""
    value = registry.get_sensor(sensor).retrieve_data(position, time_of_day_s % SECONDS_PER_DAY)
    return float(value) * _TO_CONTRACT_UNIT.get(sensor, 1.0)


@contextmanager
def _as_global_random(chance: random.Random) -> Iterator[None]:
    """Let the simulator, which draws from the process's global stream, draw from `chance`."""
    outer = random.getstate()
    random.setstate(chance.getstate())
    try:
        yield
    finally:
        chance.setstate(random.getstate())
        random.setstate(outer)
