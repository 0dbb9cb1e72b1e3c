"""Builds messages for viewers such as RViz: fields as points, tags and planters as markers.

Metres in the map frame. Unknown cells become no points, because no viewer leaves a NaN out.
Messages are serialised here, on any thread. Markers have the stamp 0, so that a viewer uses its
latest transform: they are latched, and may be shown long after.
"""

from __future__ import annotations

import math
import sys
from array import array
from collections.abc import Callable, Mapping, Sequence
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


class TagMark(NamedTuple):
    """A tag at its position, m, map frame."""

    number: int
    tag_id: str
    x: float
    y: float
    z: float
    appearance: Appearance


class PlanterMark(NamedTuple):
    """A planter's outline, (x, y, z) in m, map frame; the number is that of its first tag."""

    number: int
    corners: tuple[tuple[float, float, float], ...]


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


def tag_marks(snapshot: Snapshot) -> list[TagMark]:
    """The tags that have a pose."""
    now_ns = snapshot.now_ns
    return [
        TagMark(number, tag.tag_id, tag.pose.x, tag.pose.y, tag.pose.z, appearance_of(tag, now_ns))
        for number, tag in enumerate(snapshot.tags)
        if tag.pose is not None
    ]


def planter_marks(snapshot: Snapshot) -> list[PlanterMark]:
    """The planters whose outline was seen, each once: tags on the same planter have the same."""
    found: dict[tuple[tuple[float, float, float], ...], int] = {}
    for number, tag in enumerate(snapshot.tags):
        corners = tag.flower.footprint
        if len(corners) >= MIN_CORNERS and all(map(math.isfinite, chain(*corners))):
            found.setdefault(corners, number)
    return [PlanterMark(number, corners) for corners, number in found.items()]


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


def tag_markers(mark: TagMark, frame_id: str) -> list[Any]:
    """A ball where the tag is, and its name above it."""
    colour = COLOURS[mark.appearance]
    text = f"{mark.tag_id} (failed)" if mark.appearance == "failed" else mark.tag_id
    return [
        _marker(
            (frame_id, "tags", mark.number),
            Marker.SPHERE,
            Vector3(x=TAG_M, y=TAG_M, z=TAG_M),
            colour,
            pose=Pose(position=Point(x=mark.x, y=mark.y, z=mark.z)),
        ),
        _marker(
            (frame_id, "names", mark.number),
            Marker.TEXT_VIEW_FACING,
            Vector3(z=TEXT_M),
            colour,
            pose=Pose(position=Point(x=mark.x, y=mark.y, z=mark.z + TAG_M)),
            text=text,
        ),
    ]


def planter_markers(mark: PlanterMark, frame_id: str) -> list[Any]:
    """The planter's outline, closed."""
    return [
        _marker(
            (frame_id, "planters", mark.number),
            Marker.LINE_STRIP,
            Vector3(x=OUTLINE_M),
            PLANTER_COLOUR,
            points=[Point(x=x, y=y, z=z) for x, y, z in (*mark.corners, mark.corners[0])],
        )
    ]


def _marker(
    which: tuple[str, str, int],
    kind: int,
    scale: Any,
    colour: tuple[float, float, float],
    **more: Any,
) -> Any:
    (frame_id, namespace, number), (red, green, blue) = which, colour
    return Marker(
        header=Header(frame_id=frame_id),
        ns=namespace,
        id=number,
        type=kind,
        action=Marker.ADD,
        scale=scale,
        color=ColorRGBA(r=red, g=green, b=blue, a=1.0),
        **more,
    )


def marker_array(
    marks: Sequence[Any], make: Callable[[Any, str], list[Any]], frame_id: str
) -> bytes:
    """A serialised visualization_msgs/MarkerArray; `make(mark, frame_id)` gives a mark's markers.

    It is complete: its first marker deletes all earlier ones, so that nothing outdated stays in a
    viewer, not even from an earlier twin. It lets other threads run meanwhile.
    """
    markers = [Marker(header=Header(frame_id=frame_id), action=Marker.DELETEALL)]
    for mark in in_turns(marks):
        markers += make(mark, frame_id)
    return bytes(serialize_message(MarkerArray(markers=markers)))
