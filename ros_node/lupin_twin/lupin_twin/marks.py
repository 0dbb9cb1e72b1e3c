"""What a viewer such as RViz marks of each tag and each planter: where, and how it looks. Pure.

Numbers are those of the tags, in the order in which they were first heard of: they stay.
"""

from __future__ import annotations

import math
from itertools import chain
from typing import Final, Literal, NamedTuple

from lupin_twin.state import STATUS_OK, Snapshot, TagState

TAGS_TOPIC: Final = "twin/tags"
PLANTERS_TOPIC: Final = "twin/planters"
# As on the page: an observation is fresh for so long, s, and old from so long on.
FRESH_S: Final = 60.0
OLD_S: Final = 1800.0
# A box has so many corners at least.
MIN_CORNERS: Final = 3

Look = Literal["fresh", "fading", "old", "failed"]


class TagMark(NamedTuple):
    """A tag at its place, m, map frame."""

    number: int
    tag_id: str
    x: float
    y: float
    z: float
    look: Look


class PlanterMark(NamedTuple):
    """A planter's outline, (x, y, z) in m, map frame; the number is that of its first tag."""

    number: int
    corners: tuple[tuple[float, float, float], ...]


def look_of(tag: TagState, now_ns: int | None) -> Look:
    """Failed, if its last try was; else by the age of its last observation.

    What was never observed, or nobody knows when, is old.
    """
    if tag.last_try is not None and tag.last_try.status != STATUS_OK:
        return "failed"
    age_s = tag.stale_seconds(now_ns)
    if age_s < FRESH_S:
        return "fresh"
    return "fading" if age_s < OLD_S else "old"  # false for NaN too


def tag_marks(snapshot: Snapshot) -> list[TagMark]:
    """The tags that have a place."""
    now_ns = snapshot.now_ns
    return [
        TagMark(number, tag.tag_id, tag.pose.x, tag.pose.y, tag.pose.z, look_of(tag, now_ns))
        for number, tag in enumerate(snapshot.tags)
        if tag.pose is not None
    ]


def planter_marks(snapshot: Snapshot) -> list[PlanterMark]:
    """The planters whose outline was seen, each once: tags on the same planter tell the same."""
    found: dict[tuple[tuple[float, float, float], ...], int] = {}
    for number, tag in enumerate(snapshot.tags):
        corners = tag.flower.footprint
        if len(corners) >= MIN_CORNERS and all(map(math.isfinite, chain(*corners))):
            found.setdefault(corners, number)
    return [PlanterMark(number, corners) for corners, number in found.items()]
