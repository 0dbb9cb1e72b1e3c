"""The rules of ingestion: what was heard, as plain values, becomes a write or is dropped.

Pure. `convert` makes the values out of messages; what comes out of here is applied to the store.
Times are nanoseconds of ROS time, positions metres in the map frame.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

from lupin_twin.drops import Drop, Reason
from lupin_twin.state import (
    Flower,
    FlowerObservation,
    Observation,
    Pose,
    Reading,
    Rejected,
    TwinStore,
)

# lupin_msgs/Observation
KIND_TAG_READING: Final = 0
KIND_FLOWER: Final = 1
KIND_ANOMALY: Final = 2
STATUS_OK: Final = 0

# The `w` of half a turn, which is 0, kept apart from the 0 that stands for no pose.
HALF_TURN_W: Final = 1e-9

# What a warning quotes of a producer's own text.
_QUOTED: Final = 64


@dataclass(frozen=True, slots=True)
class HeardReading:
    """The part of an observation that a tag's sensors fill; `pose` is as it was sent."""

    tag_id: str
    stamp_ns: int
    readings: tuple[Reading, ...]
    pose: Pose


@dataclass(frozen=True, slots=True)
class HeardLook:
    """The part of an observation that the camera fills; `pose` is as it was sent."""

    tag_id: str
    frame_id: str
    flower: Flower
    pose: Pose


@dataclass(frozen=True, slots=True)
class Heard:
    """An observation as plain values; `part` is that of its kind, None where the kind has none."""

    kind: int
    status: int
    frame_id: str
    stamp_ns: int
    part: HeardReading | HeardLook | None


@dataclass(frozen=True, slots=True)
class HeardTags:
    """Discovered tags as plain values; `pose(i)` is that of `tag_ids[i]`, as it was sent.

    A producer tells all tags again and again: no pose is made before it is asked for.
    """

    frame_id: str
    tag_ids: Sequence[str]
    pose: Callable[[int], Pose]


@dataclass(frozen=True, slots=True)
class Pin:
    """A discovered tag gets its place."""

    tag_id: str
    pose: Pose


Write = Observation | FlowerObservation | Pin


def observation(heard: Heard, frame_id: str, now_ns: int) -> Write | Drop:
    """What an observation writes at `now_ns`, where poses have to be in `frame_id`."""
    part = heard.part
    if part is None:
        name = "KIND_ANOMALY" if heard.kind == KIND_ANOMALY else "an unknown kind"
        why = f"kind {heard.kind} ({name}) is not a tag's"
        return Drop(Reason.KIND, why, "an observation", case=str(heard.kind))
    own_frame = part.frame_id if isinstance(part, HeardLook) else ""
    if dropped := wrong_frame(own_frame or heard.frame_id, frame_id) or no_tag_id(part.tag_id):
        return dropped
    if isinstance(part, HeardLook):
        return _look(heard, part, now_ns)
    # Without a stamp in the header it was made when the sensors were read.
    succeeded = heard.status == STATUS_OK
    return Observation(
        tag_id=part.tag_id,
        stamp_ns=observed_at(heard.stamp_ns or part.stamp_ns, now_ns),
        readings=part.readings,
        pose=scanned_pose(part.pose) if succeeded else None,
        succeeded=succeeded,
    )


def _look(heard: Heard, part: HeardLook, now_ns: int) -> Write:
    stamp_ns = observed_at(heard.stamp_ns, now_ns)
    if heard.status != STATUS_OK:
        # The payload holds defaults, not a result; taken as one it would clear a pest unseen.
        return Observation(tag_id=part.tag_id, stamp_ns=stamp_ns, succeeded=False)
    return FlowerObservation(
        tag_id=part.tag_id,
        stamp_ns=stamp_ns,
        flower=part.flower,
        pose=scanned_pose(part.pose),
    )


def discoveries(
    heard: HeardTags, frame_id: str, is_pinned: Callable[[str], bool]
) -> Iterator[Pin | Drop]:
    """What discovered tags write, one by one: a pin each that `is_pinned` does not know by then."""
    if dropped := wrong_frame(heard.frame_id, frame_id):
        yield dropped
        return
    for index, tag_id in enumerate(heard.tag_ids):
        if dropped := no_tag_id(tag_id):
            yield dropped
        elif not is_pinned(tag_id):
            pose = discovered_pose(heard.pose(index))
            yield (
                Drop(Reason.POSE, "its pose is not finite", f"tag {tag_id[:_QUOTED]!r}")
                if pose is None
                else Pin(tag_id, pose)
            )


def apply(write: Write, store: TwinStore) -> Drop | None:
    """Write into the store; returns what the store refused."""
    try:
        match write:
            case Observation():
                store.record(write)
            case FlowerObservation():
                store.record_flower(write)
            case Pin():
                store.pin(write.tag_id, write.pose)
    except Rejected as error:
        return Drop(Reason.REJECTED, str(error))
    return None


def wrong_frame(frame_id: str, expected: str) -> Drop | None:
    """A drop, where the frame is another than the expected one; an empty one counts as that."""
    if frame_id in ("", expected):
        return None
    return Drop(Reason.FRAME, f"its frame is {frame_id[:_QUOTED]!r}, expected {expected!r}")


def no_tag_id(tag_id: str) -> Drop | None:
    """A drop, where there is no id."""
    return None if tag_id else Drop(Reason.TAG_ID, "its tag_id is empty", "an entry")


def observed_at(stamp_ns: int, now_ns: int) -> int:
    """When an observation was made: its own stamp, or now where it has none or is ahead of now.

    An observation that was latched before the twin started is as old as it says, not as young as
    its arrival. A stamp from the future (a robot's clock that runs ahead) cannot be older than
    now. While simulated time has not started (now is 0), the stamp is all there is; without one it
    was at the first moment of that time, for 0 stands for never.
    """
    if stamp_ns > 0 and (stamp_ns <= now_ns or now_ns == 0):
        return stamp_ns
    return max(now_ns, 1)


def scanned_pose(pose: Pose) -> Pose | None:
    """The pose of a scan; None where `qw` is 0 or any coordinate is not finite."""
    return pose if pose.qw != 0.0 and pose.is_finite else None


def discovered_pose(pose: Pose) -> Pose | None:
    """The pose of a discovery; None where a coordinate is not finite.

    `qw == 0` is taken as 1 where nothing else of the orientation is set. Where something is, it is
    half a turn; published as it is it would mean "no pose", so its `qw` becomes the next to nothing
    that can be told from 0, and the pose is 2e-9 rad from what was said.
    """
    if not pose.is_finite:
        return None
    if pose.qw != 0.0:
        return pose
    length = math.hypot(pose.qx, pose.qy, pose.qz)
    if length == 0.0:
        return replace(pose, qw=1.0)
    return replace(
        pose, qx=pose.qx / length, qy=pose.qy / length, qz=pose.qz / length, qw=HALF_TURN_W
    )
