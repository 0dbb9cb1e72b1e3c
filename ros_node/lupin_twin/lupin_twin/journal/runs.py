"""Runs of the clock: which one a twin that starts, or a clock that goes back, belongs to.

Pure. Wall time goes on over a restart, a simulation begins again at 0: what it said yesterday at
second 500 must not look fresh at second 510 today.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Final

# A wall clock that is set back by no more is the same clock, corrected.
CORRECTION_NS: Final = 60 * 1_000_000_000
# How much faster than before a simulation may go on.
_FASTER: Final = 2.0


class Carries(IntEnum):
    """What of an earlier run still holds as another begins."""

    NOTHING = 0
    PLACES = 1  # tags do not move, but how old their readings are is not known
    ALL = 2  # the twin lived through it: what is later than the new now ages from there on


@dataclass(frozen=True, slots=True)
class Clock:
    """A moment on both clocks, ns: ROS time, which may be simulated, and the wall's."""

    stamp_ns: int
    arrival_ns: int
    is_simulated: bool


@dataclass(frozen=True, slots=True)
class Run:
    """A stretch of ROS time that never goes back; `follows` is the id of the run before it."""

    id: int
    begun: Clock
    follows: int | None = None
    carries: Carries = Carries.NOTHING

    @property
    def lead_ns(self) -> int:
        """What arrivals are ahead of stamps, about: keeps the differences in the file small."""
        return self.begun.arrival_ns - self.begun.stamp_ns if self.begun.is_simulated else 0


@dataclass(frozen=True, slots=True)
class Ending:
    """The last run of a kind that the journal knows, and the last that was heard in it."""

    run: Run
    last: Clock


def goes_on(ending: Ending, now: Clock) -> bool:
    """Whether a twin that starts `now` is still in that run.

    A simulation is the same if its clock is further on than one could be that began after the last
    word of the old one: at twice the pace that the old one had, or the wall's. Where the wall's
    clock was set back meanwhile, how long that was is not known, and it is another.
    """
    passed = now.stamp_ns - ending.last.stamp_ns
    if not now.is_simulated:
        return passed >= -CORRECTION_NS
    waited_ns = now.arrival_ns - ending.last.arrival_ns
    if waited_ns < -CORRECTION_NS:
        return False
    begun = ending.run.begun
    lasted_ns = max(1, ending.last.arrival_ns - begun.arrival_ns)
    pace = max(1.0, (ending.last.stamp_ns - begun.stamp_ns) / lasted_ns)
    return passed >= 0 and now.stamp_ns > _FASTER * pace * max(0, waited_ns)


def carried_at_start(now: Clock) -> Carries:
    """What holds of the last run for a twin that starts in a new one."""
    return Carries.NOTHING if now.is_simulated else Carries.PLACES


def is_new_run(before: Clock, now: Clock) -> bool:
    """Whether a clock has gone back so far, while the twin lived, that a new run begins."""
    back_ns = before.stamp_ns - now.stamp_ns
    return back_ns > (0 if now.is_simulated else CORRECTION_NS)
