"""Messages of `adapt`: types by their names, scans as observations, what is said of a source."""

from __future__ import annotations

import importlib
import time
from dataclasses import dataclass, field
from typing import Any, Final

from geometry_msgs.msg import Point, Pose, Quaternion
from lupin_msgs.msg import Observation, SensorReading
from std_msgs.msg import Header

from lupin_twin.adapt.config import Place
from lupin_twin.adapt.frames import Transform
from lupin_twin.adapt.scans import BuiltScan
from lupin_twin.adapt.table import ConfigError
from lupin_twin.core.diagnostics import OK, WARN, Finding
from lupin_twin.core.drops import Tally
from lupin_twin.ros import convert

# Of a robot's visit, and of a sensor that stands at its tag.
VISIT_SOURCE: Final = "adapt"
FIXED_SOURCE: Final = "adapt/fixed"
# Their packages have no wheels: they are looked up when they are wanted.
TF_TYPE: Final = "tf2_msgs/msg/TFMessage"
DETECTIONS_TYPE: Final = "apriltag_msgs/msg/AprilTagDetectionArray"
TF: Final = "/tf"
TF_STATIC: Final = "/tf_static"


def message_type(name: str) -> Any:
    """The class of a message type such as `sensor_msgs/msg/Temperature`.

    Raises:
        ConfigError: its package is not installed, or has no such message.

    """
    package, _, message = name.partition("/msg/")
    try:
        return getattr(importlib.import_module(f"{package}.msg"), message)
    except ImportError:
        raise ConfigError(
            f"type {name}: the package {package} is not installed here, "
            f"on a robot: apt install ros-jazzy-{package.replace('_', '-')}"
        ) from None
    except AttributeError:
        raise ConfigError(f"type {name}: the package {package} has no message {message}") from None


def transform_of(message: Any, stamp_ns: int | None) -> tuple[str, Transform]:
    """A geometry_msgs/TransformStamped: the frame, and where it is in its parent."""
    at, turn = message.transform.translation, message.transform.rotation
    # tf2 takes no slash at the beginning, and ROS 1 had one.
    return message.child_frame_id.removeprefix("/"), Transform(
        message.header.frame_id.removeprefix("/"),
        stamp_ns,
        (at.x, at.y, at.z),
        (turn.x, turn.y, turn.z, turn.w),
    )


def observation(scan: BuiltScan, frame_id: str, source: str = "") -> Observation:
    """A scan as lupin_msgs/Observation; without readings, a failed one.

    Without a source, it is the adapter's own.
    """
    stamp = convert.time_msg(scan.stamp_ns)
    message = Observation(
        header=Header(stamp=stamp, frame_id=frame_id),
        source=source or (FIXED_SOURCE if scan.is_fixed else VISIT_SOURCE),
        kind=Observation.KIND_TAG_READING,
        status=Observation.STATUS_OK if scan.readings else Observation.STATUS_SCAN_FAILED,
        status_detail=scan.detail[:256],
        tag_pose_in_map=pose_of(scan.place),
    )
    message.tag_reading.tag_id = scan.tag_id
    message.tag_reading.stamp = stamp
    message.tag_reading.readings = [
        SensorReading(name=name, value=float(value)) for name, value in scan.readings
    ]
    return message


def pose_of(place: Place | None) -> Pose:
    """A place as a pose; of none, one that says so."""
    if place is None:  # `w` is 1 in ROS 2 unless it is set: a pose at the origin
        return Pose(orientation=Quaternion(x=0.0, y=0.0, z=0.0, w=0.0))
    return Pose(position=Point(x=float(place.x), y=float(place.y), z=float(place.z)))


# The source that all topics of the broker are.
MQTT: Final = "MQTT"


@dataclass(slots=True)
class Source:
    """What came, what of it is in a scan, and what was dropped.

    `problem` is what is wrong with it now, `shown` what it said last. `dropped` counts by case:
    what is wrong with one sensor must not hide what is wrong with another. `name` is the topic's
    in ROS.
    """

    name: str
    type_name: str = ""
    received: int = 0
    used: int = 0
    received_s: float = 0.0
    problem: str = ""
    shown: dict[str, str] = field(default_factory=dict)
    dropped: Tally = field(default_factory=Tally)

    def finding(self, topic: str) -> Finding:
        """The same for `/diagnostics`."""
        counts = self.dropped.value(time.monotonic())
        wrong = [self.problem] if self.problem else []
        wrong += [recent.message for recent in counts.recent]
        return Finding(
            topic,
            WARN if wrong else OK,
            "; ".join(wrong) or ("connected" if topic == MQTT else "receiving"),
            {
                "received": str(self.received),
                "used": str(self.used),
                **self.shown,
                **{f"dropped: {case}": str(count) for case, count in counts.dropped.items()},
            },
        )
