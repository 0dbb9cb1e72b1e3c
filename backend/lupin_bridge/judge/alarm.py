"""An alarm: one episode of a reason at a tag, or of the greenhouse. Pure; ns of ROS time.

It is never stored: it follows from what was observed and from the ranges.
"""

from __future__ import annotations

from dataclasses import dataclass
from hashlib import blake2b

from lupin_bridge.judge.verdict import Kind, Reason, Verdict

# The `tag_id` of an alarm of the whole greenhouse.
SITE = ""


@dataclass(frozen=True, slots=True)
class Alarm:
    """What was wrong, where, from when to when, and how bad at worst.

    `reason` is as it was when the alarm was raised, `tag_id` is `SITE` for the greenhouse. `worst`
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


def silence(last_ns: int) -> Alarm:
    """That of a twin that was received last at a moment."""
    reason = Reason(Kind.SILENT, Verdict.UNKNOWN, since_ns=last_ns)
    return Alarm(alarm_id(SITE, Kind.SILENT, "", 0, last_ns), reason, SITE, last_ns)
