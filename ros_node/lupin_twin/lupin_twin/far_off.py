"""Which tags lie so far from the others that they are on no map of the site.

A robot that is lost pins a tag anywhere, and one such pin must not decide how wide the map is. The
page has the same rule (`domain/farOff.ts`). Both are held to `tests/twin/far_off.json`.

Pure. Metres in the map frame.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from statistics import median_low
from typing import Final

from lupin_twin.state import TagState

# The greatest `max_pose_m`: what is beyond is far off, whatever the others are.
FARTHEST_M: Final = 1_000_000.0
# So near the middle no tag is far off: a house of 200 m may have most of its tags at one end.
_ALWAYS_NEAR_M: Final = 200.0
# Hampel's identifier: farther from the median than a multiple of the median distance (Davies and
# Gather, 1993). Of tags along a line the farthest are at twice the median, so this leaves room.
_SPREADS: Final = 10.0
# Far off are few: where more than one in three would be, they are a second site, and none is.
_ONE_IN: Final = 3


@dataclass(frozen=True, slots=True)
class Reach:
    """A circle about the middle of the tags; what is outside is far off."""

    x: float
    y: float
    radius_m: float

    def holds(self, x: float, y: float) -> bool:
        """Whether a point is on the map."""
        is_possible = abs(x) <= FARTHEST_M and abs(y) <= FARTHEST_M
        return is_possible and math.hypot(x - self.x, y - self.y) <= self.radius_m


def reach_of(positions: Iterable[tuple[float, float]]) -> Reach:
    """The circle of tags at these finite `positions` (x, y)."""
    everywhere = Reach(0.0, 0.0, math.inf)
    possible = [(x, y) for x, y in positions if everywhere.holds(x, y)]
    if not possible:
        return everywhere
    x, y = (median_low(axis) for axis in zip(*possible, strict=True))
    distances = [math.hypot(each_x - x, each_y - y) for each_x, each_y in possible]
    radius_m = max(_ALWAYS_NEAR_M, _SPREADS * median_low(distances))
    far = sum(distance > radius_m for distance in distances)
    return Reach(x, y, radius_m if far <= len(possible) // _ONE_IN else math.inf)


def far_off_tags(tags: Iterable[TagState]) -> list[str]:
    """The ids of those of a snapshot's `tags` that are far off."""
    pinned = [(tag.tag_id, tag.pose.x, tag.pose.y) for tag in tags if tag.pose is not None]
    reach = reach_of((x, y) for _, x, y in pinned)
    return [tag_id for tag_id, x, y in pinned if not reach.holds(x, y)]
