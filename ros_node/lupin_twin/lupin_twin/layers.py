"""A field as points in space, for viewers such as RViz: where its cells lie, and how far off it is.

Pure. Metres in the map frame. Cells of which nothing is known are no points: no viewer draws a NaN
as nothing.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from itertools import chain
from typing import Final, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from lupin_twin.estimate import EstimateGrid
from lupin_twin.fields import FieldRequest, default_box, default_request
from lupin_twin.grid import FieldGrid, cell_centres
from lupin_twin.interfaces import LAYERS_BELOW
from lupin_twin.parameters import ParameterError
from lupin_twin.state import STATUS_OK, Snapshot, TagState

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


# A point takes 20 bytes: no message is larger than 1 MB, whatever max_grid_cells says. Beside those
# of 2.5 MB, an answer of a service came 3 s late now and then; beside those of 1.4 MB, none did.
MAX_POINTS: Final = 50_000
# The columns of `points`, each float32.
COLUMNS: Final = ("x", "y", "z", "value", "error")
# What stands for an error that is not known: none is below 0.
ERROR_UNKNOWN: Final = -1.0

PointArray = npt.NDArray[np.float32]


def topic_of(sensor: str) -> str:
    """The topic of a sensor's layer, relative; what a name in ROS must not have is written in hex.

    `soil moisture` is `soil_x20_moisture`. A token that begins with no letter has `sensor_` before
    it: ROS takes no digit there, and hides what begins with an underscore. Two sensors may come to
    one name: see `topics_of`.
    """
    token = re.sub(r"[^A-Za-z0-9_]", lambda other: f"_x{ord(other.group()):x}_", sensor)
    if not re.match(r"[A-Za-z]", token):
        token = f"sensor_{token}"
    return LAYERS_BELOW + token


def topics_of(sensors: Iterable[str]) -> dict[str, str]:
    """The sensors by their topics.

    Raises:
        ParameterError: two of them come to the same.

    """
    named: dict[str, str] = {}
    for sensor in sensors:
        topic = topic_of(sensor)
        if topic in named:
            raise ParameterError(
                f"parameter layers has {named[topic]!r} and {sensor!r}, expected sensors of which "
                f"each has a topic of its own: both have {topic}"
            )
        named[topic] = sensor
    return named


def layer_request(
    sensor: str,
    positions: Iterable[tuple[float, float]],
    max_distance_m: float,
    max_grid_cells: int,
) -> FieldRequest:
    """The field of a whole house: the box of the tags' `positions`, and all that they can paint.

    Cells are as `default_request` has them, and not more than `MAX_POINTS`.
    """
    box = default_box(positions, max_distance_m)
    return default_request(sensor, box, min(max_grid_cells, MAX_POINTS))


def points(grid: FieldGrid, estimate: EstimateGrid | None) -> PointArray:
    """(n, 5): x, y, z (0, the floor), value and error of the cells whose value is known, in order.

    The error is that of the value shown, in its unit: by how much the truth is expected to differ
    from it (the root of the mean square), by the estimate on the same grid. That knows the truth to
    lie around its mean, which is not the value, with its sd. Without an estimate it is
    `ERROR_UNKNOWN`.
    """
    known = np.flatnonzero(np.isfinite(grid.values))
    rows, columns = np.divmod(known, grid.width)
    found = np.zeros((known.size, len(COLUMNS)), dtype=np.float32)
    found[:, 0] = cell_centres(grid.origin_x, grid.width, grid.resolution)[columns]
    found[:, 1] = cell_centres(grid.origin_y, grid.height, grid.resolution)[rows]
    found[:, 3] = grid.values[known]
    if estimate is None:
        found[:, 4] = ERROR_UNKNOWN
    else:
        off = grid.values[known] - estimate.mean.reshape(-1)[known].astype(np.float64)
        found[:, 4] = np.hypot(estimate.sd.reshape(-1)[known], off)
    return found
