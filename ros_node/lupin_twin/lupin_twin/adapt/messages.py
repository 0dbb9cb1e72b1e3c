"""ROS messages that `adapt` reads: message types by name, TF, and the diagnostics of a source.

A position in another frame uses the latest transform of each step between the two; tf2 would
interpolate to the time of the measurement. At 0.5 m/s and 0.1 s of delay, the latest is 5 cm off.
That is less than a tag's reach, and there is no error while the robot stands at a tag.
"""

from __future__ import annotations

import importlib
import math
import time
from dataclasses import dataclass, field
from typing import Any, Final

from lupin_twin.adapt.table import ConfigError
from lupin_twin.core.diagnostics import OK, WARN, Finding
from lupin_twin.core.drops import DropCounts

MAX_FRAMES: Final = 5_000
# A chain goes from a tag over camera, arm, base and odometry to the map; a longer one is a loop.
MAX_STEPS: Final = 32
MAX_NAME: Final = 256
# A stamp may be this far in the future: a clock may be ahead, and AMCL post-dates its transforms.
_AHEAD_NS: Final = 10_000_000_000
# How long a detection waits for its transform.
WAIT_NS: Final = 2_000_000_000


class FrameError(ValueError):
    """A transform is invalid, or a position is unknown; the message gives the reason."""


@dataclass(frozen=True, slots=True)
class Transform:
    """Pose of a frame in its parent: `move` in m, `turn` a quaternion of any length but 0.

    `stamp_ns` is None for a static transform, which is valid forever.
    """

    parent: str
    stamp_ns: int | None
    move: tuple[float, float, float]
    turn: tuple[float, float, float, float]

    def apply(self, x: float, y: float, z: float) -> tuple[float, float, float]:
        """Convert a point of the frame into its parent's coordinates."""
        qx, qy, qz, qw = self.turn
        scale = 2.0 / (qx * qx + qy * qy + qz * qz + qw * qw)
        # v + 2 q × (q × v + w v): two cross products (Rodrigues).
        cx, cy, cz = qy * z - qz * y + qw * x, qz * x - qx * z + qw * y, qx * y - qy * x + qw * z
        return (
            x + scale * (qy * cz - qz * cy) + self.move[0],
            y + scale * (qz * cx - qx * cz) + self.move[1],
            z + scale * (qx * cy - qy * cx) + self.move[2],
        )


class Frames:
    """The latest transform of each frame."""

    def __init__(self) -> None:
        self._steps: dict[str, Transform] = {}

    def __contains__(self, frame: str) -> bool:
        return frame in self._steps

    def put(self, frame: str, transform: Transform) -> None:
        """Store a transform as the frame's latest.

        Raises:
            FrameError: not finite, without rotation, a bad name, or one frame too many.

        """
        numbers = (*transform.move, *transform.turn)
        length = math.hypot(*transform.turn)
        if not all(abs(number) < 1e6 for number in numbers) or length < 1e-3:  # NaN is neither
            raise FrameError(f"the transform to {frame[:64]!r} has {numbers}, which is invalid")
        if not 0 < len(frame) <= MAX_NAME or not 0 < len(transform.parent) <= MAX_NAME:
            raise FrameError(f"a frame's name has {len(frame)} characters, the limit: {MAX_NAME}")
        if frame not in self._steps and len(self._steps) >= MAX_FRAMES:
            raise FrameError(f"more than {MAX_FRAMES} frames, the limit")
        self._steps[frame] = transform

    def stamp_ns(self, frame: str) -> int | None:
        """Stamp of the frame's own transform; None if there is none, or it is static."""
        found = self._steps.get(frame)
        return None if found is None else found.stamp_ns

    def place(
        self, frame: str, inside: str, now_ns: int, max_age_ns: int
    ) -> tuple[float, float, float]:
        """Position of the frame's origin in the frame `inside`, m.

        Raises:
            FrameError: no chain leads there, or one of its transforms is older than `max_age_ns`.

        """
        at, name = (0.0, 0.0, 0.0), frame
        for _ in range(MAX_STEPS):
            if name == inside:
                return at
            step = self._steps.get(name)
            if step is None:
                raise FrameError(
                    f"TF has no path from {frame!r} to {inside!r} (frame_id): it ends at {name!r}"
                )
            age_ns = 0 if step.stamp_ns is None else now_ns - step.stamp_ns
            if not -_AHEAD_NS <= age_ns <= max_age_ns:
                raise FrameError(
                    f"the transform from {step.parent!r} to {name!r} is {age_ns / 1e9:.1f} s old, "
                    f"the limit is {max_age_ns / 1e9:g} s"
                )
            at, name = step.apply(*at), step.parent
        raise FrameError(f"more than {MAX_STEPS} transforms from {frame!r}: TF has a loop")


class Sightings:
    """Detected tags that wait for their transforms, which are published just after a detection."""

    def __init__(self) -> None:
        self._waiting: dict[str, tuple[str, int, int]] = {}

    def see(self, frame: str, tag_id: str, stamp_ns: int, now_ns: int) -> None:
        """Add a tag that was detected at `stamp_ns`; its transform is that of `frame`."""
        if len(self._waiting) < MAX_FRAMES:
            begun_ns = self._waiting.get(frame, ("", 0, now_ns))[2]
            self._waiting[frame] = (tag_id, stamp_ns, begun_ns)

    def come(self, frames: Frames) -> list[tuple[str, str]]:
        """Tag and frame of each detection whose transform has arrived."""
        return [
            (tag_id, frame)
            for frame, (tag_id, stamp_ns, _) in self._waiting.items()
            if (moment_ns := frames.stamp_ns(frame)) is not None and moment_ns >= stamp_ns
        ]

    def end(self, frame: str) -> None:
        """Remove a frame's tag: its position is now known."""
        self._waiting.pop(frame, None)

    def missed(self, now_ns: int) -> list[str]:
        """Remove and return the frames whose transform did not arrive within WAIT_NS."""
        gone = [
            frame
            for frame, (_, _, begun_ns) in self._waiting.items()
            if not 0 <= now_ns - begun_ns <= WAIT_NS
        ]
        for frame in gone:
            del self._waiting[frame]
        return gone


# The packages of these types have no wheels, so they are imported only when needed.
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
    """Return the frame and the transform of a geometry_msgs/TransformStamped."""
    at, turn = message.transform.translation, message.transform.rotation
    # ROS 1 names had a leading slash; tf2 allows none.
    return message.child_frame_id.removeprefix("/"), Transform(
        message.header.frame_id.removeprefix("/"),
        stamp_ns,
        (at.x, at.y, at.z),
        (turn.x, turn.y, turn.z, turn.w),
    )


# All topics of the broker count as one source of this name.
MQTT: Final = "MQTT"


@dataclass(slots=True)
class Source:
    """Statistics of one source: messages received, used in a scan, and dropped.

    `name` is the ROS topic, `problem` the current fault, `shown` the last values to display.
    `dropped` counts each case separately: a fault of one sensor must not hide that of another.
    """

    name: str
    type_name: str = ""
    received: int = 0
    used: int = 0
    received_s: float = 0.0
    problem: str = ""
    shown: dict[str, str] = field(default_factory=dict)
    dropped: DropCounts = field(default_factory=DropCounts)

    def finding(self, topic: str) -> Finding:
        """Return the statistics as an entry of `/diagnostics`."""
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
