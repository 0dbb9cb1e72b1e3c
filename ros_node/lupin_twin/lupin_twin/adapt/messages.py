"""Messages of `adapt`: types by their names, transforms, what is said of a source."""

from __future__ import annotations

import importlib
import time
from dataclasses import dataclass, field
from typing import Any, Final

from lupin_twin.adapt.frames import Transform
from lupin_twin.adapt.table import ConfigError
from lupin_twin.core.diagnostics import OK, WARN, Finding
from lupin_twin.core.drops import Tally

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
