"""An alarm: one episode of a reason at a tag, or of the greenhouse. Pure; ns of ROS time.

It is never stored: it follows from what was observed and from the ranges.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from hashlib import blake2b

from lupin_bridge.judge.derived import DAILY
from lupin_bridge.judge.verdict import Reason, Verdict

# The `tag_id` of an alarm of the whole greenhouse.
HOUSE = ""


@dataclass(frozen=True, slots=True)
class Alarm:
    """What was wrong, where, from when to when, and how bad at worst.

    `reason` is as it was when the alarm was raised, `tag_id` is `HOUSE` for the greenhouse. `worst`
    is the value farthest beyond its limit, in the sensor's unit; of a pest, the most counted. The
    reason's verdict is the worst so far, `raised_as` the one with which it was raised.
    """

    id: str
    reason: Reason
    tag_id: str
    raised_at_ns: int
    cleared_at_ns: int | None = None
    worst: float | None = None
    raised_as: Verdict | None = None

    @property
    def is_worse(self) -> bool:
        """Whether its verdict is worse than the one with which it was raised."""
        return self.raised_as is not None and self.reason.verdict is not self.raised_as

    @property
    def is_active(self) -> bool:
        """Whether it has not been cleared."""
        return self.cleared_at_ns is None

    def was_active(self, at_ns: int | None) -> bool:
        """Whether it was raised, and not cleared, at a moment; None: whether it is active now."""
        if at_ns is None or self.cleared_at_ns is None:
            return self.is_active and (at_ns is None or self.raised_at_ns <= at_ns)
        return self.raised_at_ns <= at_ns < self.cleared_at_ns


def alarm_id(tag_id: str, kind: str, sensor: str, run_ns: int, began_ns: int) -> str:
    """The same for the same episode, whoever works it out.

    `began_ns` is the observation with which it began, `run_ns` when the twin's clock began to run
    that tells its time: a simulation tells the same times again and again.
    """
    digest = blake2b(digest_size=12)
    for part in (tag_id, kind, sensor, str(run_ns), str(began_ns)):
        text = part.encode("utf-8", "surrogatepass")
        digest.update(len(text).to_bytes(4, "big"))
        digest.update(text)
    return digest.hexdigest()


def reasons_of_days(
    alarms: Iterable[Alarm], at_ns: int | None = None
) -> Mapping[str, tuple[Reason, ...]]:
    """By tag, the reasons of alarms of quantities of a day that were active at a moment, or are."""
    found: dict[str, tuple[Reason, ...]] = {}
    for alarm in alarms:
        if alarm.reason.sensor in DAILY and alarm.was_active(at_ns):
            found[alarm.tag_id] = (*found.get(alarm.tag_id, ()), alarm.reason)
    return found
