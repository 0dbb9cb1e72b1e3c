"""The rules of ingestion: each received value becomes a write to the store, or is dropped.

Pure. `convert` makes the values from messages; `apply` puts the writes into the store.
Times are nanoseconds of ROS time, positions metres in the map frame.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import Final

from lupin_twin.core.drops import MAX_TEXT_LENGTH, Drop, Reason, Rejected, cut
from lupin_twin.core.history import Repeats
from lupin_twin.core.state import (
    KIND_ANOMALY,
    KIND_FLOWER,
    KIND_TAG_READING,
    STATUS_OK,
    Observation,
    Pin,
    Pose,
    TwinStore,
    Write,
)

# Replaces the `w` of a half turn, which is 0, because 0 stands for no pose.
HALF_TURN_W: Final = 1e-9

# How many characters of a producer's text a warning quotes.
_QUOTED: Final = 64


# Discovered tags, each with a function that makes its pose as sent. A producer publishes all tags
# again and again, so a pose is made only when it is needed.
ReceivedTags = Iterable[tuple[str, Callable[[], Pose]]]


def observation(
    own_frame_id: str, sent: Observation, frame_id: str, now_ns: int
) -> Observation | Drop:
    """Return what an observation writes at `now_ns`; it has to be in the frame `frame_id`.

    It is `sent` in its own frame; its pose and stamps may be invalid. The `stamp_ns` of a scan is
    when the sensors were read, `own_stamp_ns` the header's stamp.
    """
    if sent.kind not in (KIND_TAG_READING, KIND_FLOWER):
        name = "KIND_ANOMALY" if sent.kind == KIND_ANOMALY else "an unknown kind"
        why = f"kind {sent.kind} ({name}) is not a tag's"
        return Drop(Reason.KIND, why, "dropped an observation", case=str(sent.kind))
    if dropped := wrong_frame(own_frame_id, frame_id) or no_tag_id(sent.tag_id):
        return dropped
    # Without a stamp in the header, a scan's time is when the sensors were read.
    own_stamp_ns = sent.own_stamp_ns or sent.stamp_ns
    succeeded = sent.status == STATUS_OK
    return replace(
        sent,
        stamp_ns=observed_at(own_stamp_ns, now_ns),
        pose=scanned_pose(sent.pose) if succeeded and sent.pose else None,
        # A failed inspection's payload holds defaults, not a result: it would clear a pest unseen.
        flower=sent.flower if succeeded else None,
        # Cut to what can be stored, so that nothing is dropped because of a text.
        status_detail=cut(sent.status_detail),
        source=cut(sent.source),
        own_stamp_ns=own_stamp_ns,
        mission=sent.mission[:MAX_TEXT_LENGTH],
    )


def discoveries(
    received: ReceivedTags, own_frame_id: str, frame_id: str, is_pinned: Callable[[str], bool]
) -> Iterator[Pin | Drop]:
    """Yield what discovered tags write: a pin for each that `is_pinned` does not know by then."""
    if dropped := wrong_frame(own_frame_id, frame_id):
        yield dropped
        return
    for tag_id, sent_pose in received:
        if dropped := no_tag_id(tag_id):
            yield dropped
        elif not is_pinned(tag_id):
            pose = discovered_pose(sent_pose())
            yield (
                Drop(Reason.POSE, "its pose is not finite", f"dropped tag {tag_id[:_QUOTED]!r}")
                if pose is None
                else Pin(tag_id, pose)
            )


def apply(write: Write, store: TwinStore, repeats: Repeats) -> Drop | None:
    """Apply a write to the store; returns a drop if the store refuses it.

    A repeated observation only adds its pose, if the tag has none yet.
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
        store.record(news)
    except Rejected as error:
        return Drop(Reason.REJECTED, str(error))
    repeats.add(news)
    return None


def near(write: Write | Drop, max_pose_m: float) -> tuple[Write | None, Drop | None]:
    """Drop a pose with a coordinate past the limit; returns the rest of the write, and the drop.

    A robot that is lost still reads its sensors, so the rest of its observation is kept.
    """
    if isinstance(write, Drop):
        return None, write
    pose = write.pose
    if pose is None:
        return write, None
    for axis, metres in (("x", pose.x), ("y", pose.y), ("z", pose.z)):
        if abs(metres) > max_pose_m:
            what = f"dropped the pose of tag {write.tag_id[:_QUOTED]!r}"
            why = f"its {axis} is {metres:g} m, the limit is {max_pose_m:g} m (max_pose_m)"
            left = None if isinstance(write, Pin) else replace(write, pose=None)
            return left, Drop(Reason.POSE, why, what, case="far")
    return write, None


def wrong_frame(frame_id: str, expected: str) -> Drop | None:
    """Return a drop if the frame is not the expected one; an empty frame counts as expected."""
    if frame_id in ("", expected):
        return None
    return Drop(Reason.FRAME, f"its frame is {frame_id[:_QUOTED]!r}, expected {expected!r}")


def no_tag_id(tag_id: str) -> Drop | None:
    """Return a drop if the id is empty."""
    return None if tag_id else Drop(Reason.TAG_ID, "its tag_id is empty", "dropped an entry")


def observed_at(stamp_ns: int, now_ns: int) -> int:
    """When an observation was made: its own stamp, or now if that is missing or ahead of now.

    An observation that was latched before the twin started has the age of its stamp, not of its
    arrival. One with a stamp from the future (a robot's clock runs ahead) counts as made now.
    While simulated time has not started (now is 0), any stamp counts as it is. Without one, the
    observation was made at 1 ns, because 0 stands for never.
    """
    if stamp_ns > 0 and (stamp_ns <= now_ns or now_ns == 0):
        return stamp_ns
    return max(now_ns, 1)


def scanned_pose(pose: Pose) -> Pose | None:
    """The pose of a scan; None if `qw` is 0 or any coordinate is not finite."""
    return pose if pose.qw != 0.0 and pose.is_finite else None


def discovered_pose(pose: Pose) -> Pose | None:
    """The pose of a discovery; None if a coordinate is not finite.

    `qw == 0` becomes 1 if the whole orientation is 0. Otherwise it is a half turn, which unchanged
    would mean "no pose" when published. So `qw` becomes `HALF_TURN_W`, which turns the pose by
    2e-9 rad.
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
