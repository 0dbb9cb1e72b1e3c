"""What the journal keeps, as plain values. Stamps are ROS time, arrivals wall time, both in ns.

Pure. The ROS thread makes these, the writer thread writes them, restoring gives them back.
"""

from __future__ import annotations

from dataclasses import dataclass

from lupin_twin.state import Flower, Pose, Reading

# lupin_msgs/Observation
KIND_READING = 0
KIND_FLOWER = 1
STATUS_OK = 0


@dataclass(frozen=True, slots=True)
class ScanRow:
    """One try at a tag's sensors, or a look that failed; `kind` and `status` as in the message.

    `own_stamp_ns` is the stamp that it was sent with, None where that is `stamp_ns`, 0 for none.
    """

    tag_id: str
    stamp_ns: int
    arrival_ns: int
    readings: tuple[Reading, ...] = ()
    kind: int = KIND_READING
    status: int = STATUS_OK
    detail: str = ""
    source: str = ""
    mission: str = ""
    own_stamp_ns: int | None = None


@dataclass(frozen=True, slots=True)
class LookRow:
    """One look at a tag's flowers."""

    tag_id: str
    stamp_ns: int
    arrival_ns: int
    flower: Flower
    source: str = ""
    mission: str = ""
    own_stamp_ns: int | None = None


@dataclass(frozen=True, slots=True)
class PinRow:
    """A tag got its place, by whatever write: a scan, a look or a discovery."""

    tag_id: str
    stamp_ns: int
    arrival_ns: int
    pose: Pose


Row = ScanRow | LookRow | PinRow


def weight(row: Row) -> int:
    """What a row costs in memory, in readings or flowers."""
    if isinstance(row, ScanRow):
        return 1 + len(row.readings)
    if isinstance(row, LookRow):
        return 1 + len(row.flower.blooms) + len(row.flower.footprint)
    return 1
