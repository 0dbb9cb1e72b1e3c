"""The rules of ingestion: what was received, as plain values, becomes a write or is dropped.

Pure. `convert` makes the values out of messages; what comes out of here is applied to the store.
Times are nanoseconds of ROS time, positions metres in the map frame.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Final

from lupin_twin.core.drops import MAX_TEXT_LENGTH, Drop, Reason, Rejected
from lupin_twin.core.history import Repeats
from lupin_twin.core.state import (
    STATUS_OK,
    Inspection,
    Pin,
    Pose,
    Scan,
    TwinStore,
    Write,
)

# lupin_msgs/Observation; the other kinds are in `history`.
KIND_ANOMALY: Final = 2

# The `w` of half a turn, which is 0, distinct from the 0 that stands for no pose.
HALF_TURN_W: Final = 1e-9

# What a warning quotes of a producer's own text.
_QUOTED: Final = 64


@dataclass(frozen=True, slots=True)
class Received:
    """An observation as it was sent: pose and stamps too, of which not all may count.

    `sent` is None where its kind is not a tag's. `stamp_ns` of a scan is when the sensors were
    read, `own_stamp_ns` what the header says.
    """

    kind: int
    frame_id: str
    sent: Scan | Inspection | None


# Discovered tags, each with what makes its pose, as it was sent: a producer publishes all tags
# again and again, and no pose is made before it is needed.
ReceivedTags = Iterable[tuple[str, Callable[[], Pose]]]


def observation(received: Received, frame_id: str, now_ns: int) -> Scan | Inspection | Drop:
    """What an observation writes at `now_ns`, where poses have to be in `frame_id`."""
    sent = received.sent
    if sent is None:
        name = "KIND_ANOMALY" if received.kind == KIND_ANOMALY else "an unknown kind"
        why = f"kind {received.kind} ({name}) is not a tag's"
        return Drop(Reason.KIND, why, "an observation", case=str(received.kind))
    if dropped := wrong_frame(received.frame_id, frame_id) or no_tag_id(sent.tag_id):
        return dropped
    # Without a stamp in the header a scan was made when the sensors were read.
    own_stamp_ns = sent.own_stamp_ns or sent.stamp_ns
    succeeded = sent.status == STATUS_OK
    if isinstance(sent, Inspection) and not succeeded:
        # The payload of one that failed holds defaults, not a result: it would clear a pest unseen.
        sent = replace(sent, flower=None)
    return replace(
        sent,
        stamp_ns=observed_at(own_stamp_ns, now_ns),
        pose=scanned_pose(sent.pose) if succeeded and sent.pose else None,
        status_detail=_cut(sent.status_detail),
        source=_cut(sent.source),
        own_stamp_ns=own_stamp_ns,
        mission=sent.mission[:MAX_TEXT_LENGTH],
    )


def _cut(text: str) -> str:
    """A producer's text, no longer than any that is stored: nothing is dropped for it."""
    return text if len(text) <= MAX_TEXT_LENGTH else f"{text[: MAX_TEXT_LENGTH - 1]}…"


def discoveries(
    received: ReceivedTags, own_frame_id: str, frame_id: str, is_pinned: Callable[[str], bool]
) -> Iterator[Pin | Drop]:
    """What discovered tags write, one by one: a pin each that `is_pinned` does not know by then."""
    if dropped := wrong_frame(own_frame_id, frame_id):
        yield dropped
        return
    for tag_id, sent_pose in received:
        if dropped := no_tag_id(tag_id):
            yield dropped
        elif not is_pinned(tag_id):
            pose = discovered_pose(sent_pose())
            yield (
                Drop(Reason.POSE, "its pose is not finite", f"tag {tag_id[:_QUOTED]!r}")
                if pose is None
                else Pin(tag_id, pose)
            )


def apply(write: Write, store: TwinStore, repeats: Repeats) -> Drop | None:
    """Write what is now; returns what the store refused.

    What was received before is nothing new, but for a place that its tag does not have yet.
    """
    try:
        if isinstance(write, Pin):
            store.pin(write.tag_id, write.pose)
            return None
        news = repeats.news(write)
        if news is None:
            if write.pose is not None:
                store.pin(write.tag_id, write.pose)
            return None
        if isinstance(news, Scan):
            store.record(news)
        else:
            store.record_inspection(news)
    except Rejected as error:
        return Drop(Reason.REJECTED, str(error))
    repeats.add(news)
    return None


def near(write: Write | Drop, max_pose_m: float) -> tuple[Write | None, Drop | None]:
    """What is left of a write, and what is dropped of it: a pose with a coordinate past the limit.

    A robot that is lost still reads its sensors: what else an observation brought stays.
    """
    if isinstance(write, Drop):
        return None, write
    pose = write.pose
    if pose is None:
        return write, None
    for axis, metres in (("x", pose.x), ("y", pose.y), ("z", pose.z)):
        if abs(metres) > max_pose_m:
            what = f"the pose of tag {write.tag_id[:_QUOTED]!r}"
            why = f"its {axis} is {metres:g} m, the limit is {max_pose_m:g} m (max_pose_m)"
            left = None if isinstance(write, Pin) else replace(write, pose=None)
            return left, Drop(Reason.POSE, why, what, case="far")
    return write, None


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
    that differs from 0, and the pose is 2e-9 rad from what was sent.
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
