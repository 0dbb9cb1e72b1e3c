"""Producers whose stamps stay behind their own earlier ones: a clock that has gone back. Pure.

What such a producer says is ignored until its clock has caught up, for what is newer stays; that
must not happen in silence. A little out of order is normal, and so are:

- a message that overtakes a few others, or a slow one: the next in order ends the run;
- looks that come out of a slow pipeline behind later scans: each kind has its own order;
- latched messages of a second producer of the same name, heard as one of them is found: they come
  at once, long after they were published. Such a burst counts as one message.

Times are nanoseconds of ROS time; `now_s` is seconds of a clock that never jumps.
"""

from __future__ import annotations

import math
from collections import OrderedDict
from dataclasses import dataclass
from typing import Final

# So many in a row may be behind before anything is said.
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
        """What to tell the operator."""
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
        """Note an observation that was not heard before; returns what is wrong with its source.

        `was_latched`: it was published well before it was heard.
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
