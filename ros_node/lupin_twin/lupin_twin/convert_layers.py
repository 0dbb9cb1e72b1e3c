"""Layers and marks as the messages that viewers such as RViz read, serialised, on any thread.

Markers have the stamp 0, by which a viewer takes its newest transform: they are latched, and may be
looked at long after.
"""

from __future__ import annotations

import sys
from collections.abc import Hashable, Iterable, Iterator, Mapping
from typing import Any, Final

from geometry_msgs.msg import Point, Pose, Vector3
from rclpy.serialization import serialize_message
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from lupin_twin.convert import time_msg
from lupin_twin.layers import COLUMNS, Look, PlanterMark, PointArray, TagMark
from lupin_twin.workers import in_turns

_FLOAT32_BYTES: Final = 4
# What stands before a serialised message, and the count before a list.
_CDR_HEAD: Final = 4
_COUNT: Final = 4

TAG_M: Final = 0.15
TEXT_M: Final = 0.12
OUTLINE_M: Final = 0.03
# Red, green, blue. They say how old and whether it failed, and judge nothing: so neither green nor
# red, which on the page are verdicts. Who cannot tell them apart reads a failure in the text.
COLOURS: Final[Mapping[Look, tuple[float, float, float]]] = {
    "fresh": (0.10, 0.42, 0.85),
    "fading": (0.55, 0.72, 0.92),
    "old": (0.55, 0.55, 0.55),
    "failed": (0.75, 0.20, 0.65),
}
PLANTER_COLOUR: Final = (0.55, 0.38, 0.22)


def cloud(points: PointArray, stamp_ns: int, frame_id: str) -> bytes:
    """The points as a serialised sensor_msgs/PointCloud2, at the time of the state.

    Put in between what ROS serialises without them: that takes several times as long, in which it
    keeps the interpreter, and so every other thread.
    """
    step = len(COLUMNS) * _FLOAT32_BYTES
    bare = bytes(
        serialize_message(
            PointCloud2(
                header=Header(stamp=time_msg(stamp_ns), frame_id=frame_id),
                height=1,
                width=len(points),
                fields=[
                    PointField(
                        name=name,
                        offset=index * _FLOAT32_BYTES,
                        datatype=PointField.FLOAT32,
                        count=1,
                    )
                    for index, name in enumerate(COLUMNS)
                ],
                is_bigendian=sys.byteorder == "big",
                point_step=step,
                row_step=step * len(points),
                is_dense=True,
            )
        )
    )
    # It ends with the count of bytes, none, and with is_dense, 1; there may be padding behind it.
    count = bare.rindex(1) - _COUNT
    data = points.tobytes()
    is_dense = bare[count + _COUNT : count + _COUNT + 1]
    return b"".join([bare[:count], len(data).to_bytes(_COUNT, sys.byteorder), data, is_dense])


def tag_markers(mark: TagMark, frame_id: str) -> list[Any]:
    """A ball where the tag is, and its name above it."""
    colour = COLOURS[mark.look]
    said = f"{mark.tag_id} (failed)" if mark.look == "failed" else mark.tag_id
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
            text=said,
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
    """Builds visualization_msgs/MarkerArray of marks, and keeps each one's part until it changes.

    An array says all there is: its first marker deletes what was there before, so nothing that is
    gone stays in a viewer, not even from a twin before this one. Belongs to one thread at a time.
    """

    def __init__(self, make: Any, frame_id: str) -> None:
        """`make(mark, frame_id)` gives the markers of a mark."""
        self._make = make
        self._frame_id = frame_id
        self._parts: dict[Hashable, list[_Part]] = {}
        self._clear = _part(Marker(header=Header(frame_id=frame_id), action=Marker.DELETEALL))

    def build(self, marks: Iterable[Hashable]) -> bytes:
        """The marks' array, serialised; only those that changed are made anew, in turns."""
        before, self._parts = self._parts, {}
        for mark in in_turns(marks):
            self._parts[mark] = before.get(mark) or [
                _part(marker) for marker in self._make(mark, self._frame_id)
            ]
        parts = [self._clear, *(part for of_mark in self._parts.values() for part in of_mark)]
        head = bytes(serialize_message(MarkerArray()))[:_CDR_HEAD]
        return b"".join([head, len(parts).to_bytes(_COUNT, sys.byteorder), *_joined(parts)])

    def forget(self) -> None:
        """Keep nothing: nobody looks."""
        self._parts = {}


# A marker serialised where the offset is a multiple of 8, and where it is one of 4 alone.
_Part = tuple[bytes, bytes]


def _part(marker: Any) -> _Part:
    """Its numbers of eight bytes stand at multiples of 8: where it begins decides on the gaps."""
    alone = bytes(serialize_message(marker))[_CDR_HEAD:]
    behind = bytes(serialize_message(MarkerArray(markers=[marker])))[_CDR_HEAD + _COUNT :]
    return _padded(alone), _padded(behind)


def _padded(part: bytes) -> bytes:
    return part + bytes(-len(part) % 4)


def _joined(parts: Iterable[_Part]) -> Iterator[bytes]:
    offset = _COUNT
    for part in parts:
        fitting = part[offset % 8 == 4]
        offset += len(fitting)
        yield fitting
