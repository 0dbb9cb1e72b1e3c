"""Detects whether ROS time runs, and whether producers' stamps keep up with it. Pure.

An age means something only while the clock runs: with a stopped clock, an observation of an hour
ago would look new. So nothing shows an age without this check.

A producer whose stamps stay behind its own earlier ones has a clock that went back. Its
observations do not change the state until that clock has caught up; the operator has to know.
Slight disorder is normal, and is not reported:

- a message that overtakes a few others, or is slow: the next one in order ends the run;
- inspections from a slow pipeline that arrive after later scans: each kind has its own order;
- latched messages of a second producer of the same name: they arrive in a burst when it is
  discovered, long after they were published. Such a burst counts as one message.

Stamps are nanoseconds of ROS time; `now_s` is seconds of a clock that never jumps.
"""

from __future__ import annotations

import math
from collections import OrderedDict
from dataclasses import dataclass
from typing import Final

from lupin_twin.core.drops import Drop, Reason
from lupin_twin.core.state import ClockState

# A clock that has not moved for this long, s of steady time, is not running.
STANDS_AFTER_S: Final = 3.0
# After standing for this long, s, it is worth subscribing to see whether `/clock` is still sent.
SUBSCRIBE_AFTER_S: Final = 1.0


class ClockWatch:
    """Follows one clock; times are ROS time in ns, and s of a clock that never jumps."""

    def __init__(self) -> None:
        self.state: ClockState = "none"
        self.should_subscribe = False
        self._last_ns = 0
        self._moved_s = 0.0
        self._message_s: float | None = None

    def add_message(self, now_s: float) -> None:
        """Note that a message arrived on `/clock`, whatever its time is."""
        self._message_s = now_s

    def update(self, ros_ns: int, now_s: float, *, is_simulated: bool) -> ClockState:
        """Note the time; returns the state of the clock.

        A clock that is not simulated is the system's, and always runs. A simulated clock that was
        never set is at 0.
        """
        if ros_ns != self._last_ns:
            self._last_ns, self._moved_s = ros_ns, now_s
        standing_s = now_s - self._moved_s
        self.should_subscribe = is_simulated and ros_ns > 0 and standing_s >= SUBSCRIBE_AFTER_S
        if not self.should_subscribe:
            self._message_s = None
        has_come = self._message_s is not None and now_s - self._message_s < STANDS_AFTER_S
        if is_simulated and ros_ns <= 0:
            self.state = "none"
        elif not is_simulated or standing_s < STANDS_AFTER_S:
            self.state = "running"
        else:
            self.state = "paused" if has_come else "stopped"
        return self.state


def reported_clock(
    reported: ClockState | None, stamp_ns: int, *, ages_are_known: bool
) -> ClockState:
    """The state of a twin's clock in another process: by the twin's report, if there is one.

    The report comes once a second, so a newer state contradicts it now and then. `ages_are_known`:
    none of that state's ages is NaN.
    """
    if stamp_ns <= 0:
        return "none"
    if not ages_are_known:
        return "doubted" if reported == "doubted" else "stopped"
    return reported or "running"


# Up to this many late observations in a row are not reported.
FEW: Final = 5
# A message received this long after it was published comes from a publisher's latch.
LATCHED_AFTER_S: Final = 0.5
# Latched messages within this time count as one.
APART_S: Final = 2.0
# A broken producer may change its name with each message; further names are counted together.
MAX_SOURCES: Final = 64
OTHERS: Final = "(others)"


@dataclass(slots=True)
class _Stream:
    newest_ns: int
    run: int = 0
    last_s: float = -math.inf


class Lateness:
    """Follows the stamps of each source and kind; `counts` are the late observations by source."""

    def __init__(self) -> None:
        self.counts: dict[str, int] = {}
        self._streams: OrderedDict[tuple[str, int], _Stream] = OrderedDict()

    def see(
        self, source: str, kind: int, stamp_ns: int, *, was_latched: bool, now_s: float
    ) -> Drop | None:
        """Note a new observation; reports the run of late ones that it belongs to, if it is long.

        It counts what is new since the last report: the first time, the whole run. `was_latched`:
        it was published well before it was received.
        """
        stream = self._streams.setdefault((source, kind), _Stream(stamp_ns))
        self._streams.move_to_end((source, kind))
        while len(self._streams) > MAX_SOURCES:
            self._streams.popitem(last=False)
        if stamp_ns >= stream.newest_ns:
            stream.newest_ns, stream.run = stamp_ns, 0
            return None
        if was_latched and now_s - stream.last_s < APART_S:
            return None
        stream.run += 1
        stream.last_s = now_s
        if stream.run <= FEW:
            return None
        news = stream.run if stream.run == FEW + 1 else 1
        why = (
            f"{stream.run} observations in a row from source {source!r} are older than its own "
            f"earlier ones, the last by {(stream.newest_ns - stamp_ns) / 1e9:.0f} s: what is newer "
            "stays, they only enter the history. Has its clock gone back?"
        )
        name = self._count(source, news)
        return Drop(Reason.LATE_STAMP, why, "late stamps", case=name, count=news)

    def clamp_to(self, now_ns: int) -> None:
        """Follow ROS time that went back for everybody: no source is late because of it."""
        for stream in self._streams.values():
            stream.newest_ns, stream.run = min(stream.newest_ns, now_ns), 0

    def _count(self, source: str, late: int) -> str:
        is_counted = source in self.counts or len(self.counts) < MAX_SOURCES
        name = source if is_counted else OTHERS
        self.counts[name] = self.counts.get(name, 0) + late
        return name
