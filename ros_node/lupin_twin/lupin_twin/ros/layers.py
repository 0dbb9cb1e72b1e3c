"""Fields as points, tags and planters as markers: the messages that viewers such as RViz read.

Metres in the map frame. Cells of which nothing is known are no points: no viewer draws a NaN as
nothing. Messages are serialised here, on any thread. Markers have the stamp 0, by which a viewer
takes its newest transform: they are latched, and may be shown long after.
"""

from __future__ import annotations

import math
import re
import sys
from array import array
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from itertools import chain
from typing import Any, Final, Literal, NamedTuple

import numpy as np
import numpy.typing as npt
from geometry_msgs.msg import Point, Pose, Vector3
from rclpy.serialization import serialize_message
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from lupin_twin.core.interfaces import LAYERS_BELOW
from lupin_twin.core.parameters import ParameterError
from lupin_twin.core.state import STATUS_OK, Snapshot, TagState
from lupin_twin.estimate.posterior import EstimateGrid
from lupin_twin.field.grid import FieldGrid, cell_centres
from lupin_twin.ros.convert import time_msg
from lupin_twin.runtime.workers import in_turns

# As on the page: an observation is fresh for so long, s, and old from so long on.
FRESH_S: Final = 60.0
OLD_S: Final = 1800.0
# A box has so many corners at least.
MIN_CORNERS: Final = 3

Appearance = Literal["fresh", "fading", "old", "failed"]


class TagMark(NamedTuple):
    """A tag at its place, m, map frame."""

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
    """Failed, if its last attempt was; else by the age of its last observation.

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


# --- messages -------------------------------------------------------------------------------

_FLOAT32_BYTES: Final = 4

TAG_M: Final = 0.15
TEXT_M: Final = 0.12
OUTLINE_M: Final = 0.03
# Red, green, blue. They say how old and whether it failed, and judge nothing: so neither green nor
# red, which on the page are verdicts. Whoever sees no colours reads a failure in the text.
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


class MarkerArrays:
    """Builds visualization_msgs/MarkerArray of one kind of marks, and caches each one's markers.

    An array says all there is: its first marker deletes what was there before, so nothing that is
    gone stays in a viewer, not even from a twin before this one. Belongs to one thread at a time.
    """

    def __init__(
        self,
        marks: Callable[[Snapshot], Sequence[Any]],
        make: Callable[[Any, str], list[Any]],
        frame_id: str,
    ) -> None:
        """`make(mark, frame_id)` gives the markers of one of the `marks(snapshot)`."""
        self._marks = marks
        self._make = make
        self._frame_id = frame_id
        self._markers: dict[Hashable, list[Any]] | None = None
        self._clear = Marker(header=Header(frame_id=frame_id), action=Marker.DELETEALL)

    def build(self, snapshot: Snapshot) -> bytes | None:
        """The array, serialised, if it is another than the one before; made in turns."""
        marks, before = self._marks(snapshot), self._markers
        if before is not None and marks == [*before]:
            return None
        self._markers = {}
        for mark in in_turns(marks):
            known = None if before is None else before.get(mark)
            self._markers[mark] = known or self._make(mark, self._frame_id)
        markers = [self._clear, *chain.from_iterable(self._markers.values())]
        return bytes(serialize_message(MarkerArray(markers=markers)))
