"""The camera's list of tags: a tag is discovered when it first comes into view."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, dist, radians

import numpy as np

from lupin_patrol.chance import stream
from lupin_patrol.geometry import Point, crossings
from lupin_patrol.house import House, Tag
from lupin_patrol.plants import SPECIES, Plants

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

    def __init__(self, house: House, plants: Plants, seed: int) -> None:
        self._house = house
        self._tables = [table.rect for table in house.tables]
        self._plants = plants
        self._seed = seed
        self._guesses: dict[str, tuple[str, float]] = {}
        self._anomalies: dict[str, bool] = {}
        self._counts: dict[str, int] = {}

    def look_from(self, position: Point, pass_index: int) -> bool:
        """Take one picture all around; returns whether it shows a tag for the first time."""
        found = False
        for tag in self._house.tags:
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
                tag=self._house.tag(tag_id),
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
