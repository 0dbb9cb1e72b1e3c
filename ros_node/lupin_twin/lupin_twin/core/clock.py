"""Whether ROS time runs, and whether producers' stamps follow it. Pure.

Ages by a clock that does not run are no ages: an observation of an hour ago would look new for as
long as nobody moves the clock. So nothing shows an age without this.

A producer whose stamps stay behind its own earlier ones has a clock that has gone back. What it
sends is ignored until that has caught up, for what is newer stays; that must not happen in silence.
A little out of order is normal, and so are:

- a message that overtakes a few others, or a slow one: the next in order ends the run;
- inspections from a slow pipeline behind later scans: each kind has its own order;
- latched messages of a second producer of the same name, received as one of them is found: they
  come at once, long after they were published. Such a burst counts as one message.

Stamps are nanoseconds of ROS time; `now_s` is seconds of a clock that never jumps.
"""

from __future__ import annotations

import math
from collections import OrderedDict
from dataclasses import dataclass
from typing import Final

from lupin_twin.core.state import ClockState

# A clock that has not moved for so long, s of steady time, does not run.
STANDS_AFTER_S: Final = 3.0
# What a twin says of its clock, once a second, is true of so long ago, s, with room for a slow one.
REPORT_LAG_S: Final = 2.0
# From here on it is worth listening whether `/clock` still comes.
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
        """A message came on `/clock`, whatever it says."""
        self._message_s = now_s

    def update(self, ros_ns: int, now_s: float, *, is_simulated: bool) -> ClockState:
        """Note the time; returns the state of the clock.

        A clock that is not simulated is the system's, and runs. One that is simulated and was never
        set is at 0.
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


class StampWatch:
    """The state of a twin's clock, for a process that receives its states.

    A stamp that stands may be that of a clock that is paused, and then only the twin itself knows.
    Where it does not say so, the clock has stopped: a guess never means that all is well.
    """

    def __init__(self) -> None:
        self._last_ns: int | None = None
        self._has_moved = False
        self._moved_s = 0.0

    def update(
        self,
        stamp_ns: int,
        now_s: float,
        *,
        ages_are_known: bool,
        reported: ClockState | None = None,
    ) -> ClockState:
        """Note a state's stamp; `ages_are_known`: the twin gave no age as NaN.

        `reported` is what the twin reported of its clock, up to `REPORT_LAG_S` behind what its
        states say; None: nothing.
        """
        if stamp_ns != self._last_ns:
            self._has_moved = self._last_ns is not None
            self._last_ns, self._moved_s = stamp_ns, now_s
        if stamp_ns <= 0:
            return "none"
        if not ages_are_known:
            return "doubted" if reported == "doubted" else "stopped"
        standing_s = now_s - self._moved_s
        if reported == "paused" and (standing_s >= STANDS_AFTER_S or not self._has_moved):
            return "paused"
        lag_s = REPORT_LAG_S if reported == "running" else 0.0
        return "running" if standing_s < STANDS_AFTER_S + lag_s else "stopped"


# So many in a row may be behind before anything is reported.
FEW: Final = 5
# What was published so long before it was received comes out of a publisher's latch.
LATCHED_AFTER_S: Final = 0.5
# Messages out of a latch count again only after so long.
APART_S: Final = 2.0
# A broken producer may call itself something else each time: the rest is counted together.
MAX_SOURCES: Final = 64
OTHERS: Final = "(others)"


@dataclass(frozen=True, slots=True)
class Late:
    """More than a few in a row that are behind: how many, and by how much the last of them, s.

    `counted_as` is one of few names: that of the source, or `OTHERS`. `news` is how many have been
    counted just now: the first time, the whole run.
    """

    source: str
    run: int
    behind_s: float
    counted_as: str
    news: int = 1

    def __str__(self) -> str:
        """The text for the operator."""
        return (
            f"{self.run} observations in a row from source {self.source!r} are older than its own "
            f"earlier ones, the last by {self.behind_s:.0f} s: what is newer stays, they only "
            "enter the history. Has its clock gone back?"
        )


@dataclass(slots=True)
class _Stream:
    newest_ns: int
    run: int = 0
    last_s: float = -math.inf


class Lateness:
    """Follows the stamps of each source and kind; `counts` is what was late, by source."""

    def __init__(self) -> None:
        self.counts: dict[str, int] = {}
        self._streams: OrderedDict[tuple[str, int], _Stream] = OrderedDict()

    def see(
        self, source: str, kind: int, stamp_ns: int, *, was_latched: bool, now_s: float
    ) -> Late | None:
        """Note an observation that was not received before; returns what is wrong with its source.

        `was_latched`: it was published well before it was received.
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
        name = self._count(source, news)
        return Late(source, stream.run, (stream.newest_ns - stamp_ns) / 1e9, name, news)

    def hold_to(self, now_ns: int) -> None:
        """Follow a clock that has gone back for all, and nobody is late by it."""
        for stream in self._streams.values():
            stream.newest_ns, stream.run = min(stream.newest_ns, now_ns), 0

    def _count(self, source: str, late: int) -> str:
        is_counted = source in self.counts or len(self.counts) < MAX_SOURCES
        name = source if is_counted else OTHERS
        self.counts[name] = self.counts.get(name, 0) + late
        return name
