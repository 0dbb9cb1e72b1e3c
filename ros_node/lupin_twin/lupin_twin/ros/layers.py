"""Builds messages for viewers such as RViz: fields as points, tags and planters as markers.

Metres in the map frame. Unknown cells become no points, because no viewer leaves a NaN out.
Messages are serialised here, on any thread. Markers have the stamp 0, so that a viewer uses its
latest transform: they are latched, and may be shown long after.
"""

from __future__ import annotations

import math
import sys
from array import array
from collections.abc import Iterable, Iterator, Mapping
from itertools import chain
from typing import Any, Final, Literal, NamedTuple

import numpy as np
import numpy.typing as npt
from geometry_msgs.msg import Point, Pose, Vector3
from rclpy.serialization import serialize_message
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from lupin_twin.core.state import STATUS_OK, Snapshot, TagState
from lupin_twin.estimate.posterior import EstimateGrid
from lupin_twin.field.grid import FieldGrid, cell_centres
from lupin_twin.ros.convert import time_msg
from lupin_twin.runtime.workers import in_turns

# As on the page: below this age, s, an observation is fresh, and from this age on it is old.
FRESH_S: Final = 60.0
OLD_S: Final = 1800.0
# A planter's outline has at least this many corners.
MIN_CORNERS: Final = 3

Appearance = Literal["fresh", "fading", "old", "failed"]


TAG_M: Final = 0.15
TEXT_M: Final = 0.12
OUTLINE_M: Final = 0.03
# Red, green, blue. Colours show age and failure, but no status, so they are neither green nor red,
# which on the page show a status. For people who cannot see colours, a failure is in the text too.
COLOURS: Final[Mapping[Appearance, tuple[float, float, float]]] = {
    "fresh": (0.10, 0.42, 0.85),
    "fading": (0.55, 0.72, 0.92),
    "old": (0.55, 0.55, 0.55),
    "failed": (0.75, 0.20, 0.65),
}
PLANTER_COLOUR: Final = (0.55, 0.38, 0.22)


class Mark(NamedTuple):
    """What a marker shows, as values that can be compared; positions and sizes in m, map frame."""

    namespace: str
    number: int
    kind: int
    scale: tuple[float, float, float]
    colour: tuple[float, float, float]
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    text: str = ""
    points: tuple[tuple[float, float, float], ...] = ()


def appearance_of(tag: TagState, now_ns: int | None) -> Appearance:
    """Failed, if the tag's last attempt failed; else by the age of its last observation.

    A tag that was never observed, or at an unknown time, is old.
    """
    if tag.last_try is not None and tag.last_try.status != STATUS_OK:
        return "failed"
    age_s = tag.stale_seconds(now_ns)
    if age_s < FRESH_S:
        return "fresh"
    return "fading" if age_s < OLD_S else "old"  # false for NaN too


def tag_marks(snapshot: Snapshot) -> Iterator[Mark]:
    """A ball where each tag is that has a pose, and its name above it."""
    ball, text = (TAG_M, TAG_M, TAG_M), (0.0, 0.0, TEXT_M)
    for number, tag in enumerate(snapshot.tags):
        if tag.pose is not None:
            look, x, y, z = appearance_of(tag, snapshot.now_ns), tag.pose.x, tag.pose.y, tag.pose.z
            name = f"{tag.tag_id} (failed)" if look == "failed" else tag.tag_id
            above = x, y, z + TAG_M
            yield Mark("tags", number, Marker.SPHERE, ball, COLOURS[look], (x, y, z))
            yield Mark("names", number, Marker.TEXT_VIEW_FACING, text, COLOURS[look], above, name)


def planter_marks(snapshot: Snapshot) -> Iterator[Mark]:
    """The closed outline of each planter that was seen, numbered as its first tag.

    Tags on the same planter have the same outline.
    """
    found: set[tuple[tuple[float, float, float], ...]] = set()
    for number, tag in enumerate(snapshot.tags):
        corners, line = tag.flower.footprint, (OUTLINE_M, 0.0, 0.0)
        is_outline = len(corners) >= MIN_CORNERS and all(map(math.isfinite, chain(*corners)))
        if is_outline and corners not in found:
            found.add(corners)
            closed = *corners, corners[0]
            yield Mark("planters", number, Marker.LINE_STRIP, line, PLANTER_COLOUR, points=closed)


# A point takes 20 bytes: no message is larger than 1 MB, whatever max_grid_cells is. With messages
# of 2.5 MB, a service's response was 3 s late now and then; with 1.4 MB, none was.
MAX_POINTS: Final = 50_000
# The columns of `points`, each float32.
COLUMNS: Final = ("x", "y", "z", "value", "error")
# Stands for an unknown error; no error is below 0.
ERROR_UNKNOWN: Final = -1.0

PointArray = npt.NDArray[np.float32]


def points(grid: FieldGrid, estimate: EstimateGrid | None) -> PointArray:
    """(n, 5): x, y, z (0, the floor), value and error of the cells whose value is known, in order.

    The error is that of the value shown, in its unit: its root mean square deviation from the true
    value, by the estimate on the same grid. That has the true value around the estimate's mean,
    which is not the value shown, with its sd. Without an estimate the error is `ERROR_UNKNOWN`.
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


# --- messages -------------------------------------------------------------------------------

_FLOAT32_BYTES: Final = 4


def cloud(points: PointArray, stamp_ns: int, frame_id: str) -> bytes:
    """The points as a serialised sensor_msgs/PointCloud2, at the time of the state."""
    step = len(COLUMNS) * _FLOAT32_BYTES
    fields = [
        PointField(name=name, offset=index * _FLOAT32_BYTES, datatype=PointField.FLOAT32, count=1)
        for index, name in enumerate(COLUMNS)
    ]
    message = PointCloud2(
        header=Header(stamp=time_msg(stamp_ns), frame_id=frame_id),
        height=1,
        width=len(points),
        fields=fields,
        is_bigendian=sys.byteorder == "big",
        point_step=step,
        row_step=step * len(points),
        data=array("B", points.tobytes()),
        is_dense=True,
    )
    return bytes(serialize_message(message))


def marker_array(marks: Iterable[Mark], frame_id: str) -> bytes:
    """The marks as a serialised visualization_msgs/MarkerArray; lets other threads run meanwhile.

    It is complete: its first marker deletes all earlier ones, so that nothing outdated stays in a
    viewer, not even from an earlier twin.
    """
    header = Header(frame_id=frame_id)
    markers = [Marker(header=header, action=Marker.DELETEALL)]
    markers += [
        Marker(
            header=header,
            ns=mark.namespace,
            id=mark.number,
            type=mark.kind,
            action=Marker.ADD,
            scale=_xyz(Vector3, mark.scale),
            color=ColorRGBA(**dict(zip("rgb", mark.colour, strict=True)), a=1.0),
            pose=Pose(position=_xyz(Point, mark.position)),
            text=mark.text,
            points=[_xyz(Point, at) for at in mark.points],
        )
        for mark in in_turns(marks)
    ]
    return bytes(serialize_message(MarkerArray(markers=markers)))


def _xyz(kind: Any, at: tuple[float, float, float]) -> Any:
    return kind(**dict(zip("xyz", at, strict=True)))
