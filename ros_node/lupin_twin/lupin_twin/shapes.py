"""The messages that are listened to, and the most that is taken of each: what can be kept.

What is larger, or claims to be, is dropped before a single object is made of it.
"""

from __future__ import annotations

from typing import Final

from builtin_interfaces import msg as builtin
from diagnostic_msgs import msg as diagnostic
from geometry_msgs import msg as geometry
from lupin_msgs import msg as lupin
from nav_msgs import msg as nav
from std_msgs import msg as std

from lupin_twin.bounds import (
    MAX_BLOOMS_PER_TAG,
    MAX_FOOTPRINT_POINTS,
    MAX_ITEMS,
    MAX_SENSORS_PER_TAG,
    MAX_TAGS,
)
from lupin_twin.cdr import MessageShape

MAX_STATUSES: Final = 1_000
MAX_STATUS_VALUES: Final = 10_000

_PACKAGES: Final = {
    "builtin_interfaces": builtin,
    "diagnostic_msgs": diagnostic,
    "geometry_msgs": geometry,
    "lupin_msgs": lupin,
    "nav_msgs": nav,
    "std_msgs": std,
}

# An observation with 2,000 flowers has some 150 kB.
OBSERVATION: Final = MessageShape(
    lupin.Observation,
    _PACKAGES,
    max_bytes=1_000_000,
    limits={
        "tag_reading.readings": MAX_SENSORS_PER_TAG,
        "flower.flowers": MAX_BLOOMS_PER_TAG,
        "flower.box_footprint.points": MAX_FOOTPRINT_POINTS,
    },
)
# A discovery of 20,000 tags has 2.5 MB.
DISCOVERED_TAGS: Final = MessageShape(
    lupin.DiscoveredTags, _PACKAGES, max_bytes=8_000_000, limits={"tags": MAX_TAGS}
)
# A map of 4,000 × 4,000 cells has 16 MB.
MAP: Final = MessageShape(nav.OccupancyGrid, _PACKAGES, max_bytes=64_000_000)
# 20,000 tags with ten sensors and forty flowers each have 48 MB. How many a single tag has is for
# the twin to bound that publishes it.
STATE: Final = MessageShape(
    lupin.TwinState,
    _PACKAGES,
    max_bytes=64_000_000,
    limits={"tags": MAX_TAGS},
    max_elements=MAX_TAGS + MAX_ITEMS,
)
# As many tags and readings, each reading with its name and its time.
TIMES: Final = MessageShape(
    lupin.TwinTimes,
    _PACKAGES,
    max_bytes=64_000_000,
    limits={"tags": MAX_TAGS},
    max_elements=MAX_TAGS + 2 * MAX_ITEMS,
)
# A twin says seven things of itself, with a few dozen values, in some kB. Whoever collects those of
# a whole robot has more; it is told on a topic that all nodes share.
DIAGNOSTICS: Final = MessageShape(
    diagnostic.DiagnosticArray,
    _PACKAGES,
    max_bytes=1_000_000,
    limits={"status": MAX_STATUSES},
    max_elements=MAX_STATUSES + MAX_STATUS_VALUES,
)
