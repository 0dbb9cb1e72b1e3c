"""Whether estimates are calibrated: of what they predicted, how much lay in their intervals.

Pure. Counted by the hour, a 24th of a day of the greenhouse's own length, over the last day and
week. Times are ns of ROS time.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

from lupin_twin.core.state import NANOSECONDS_PER_SECOND

# The interval predicted: 9 of 10 are to lie within mean +- so many sds.
HALF_WIDTH_SDS: Final = 1.645
HOURS_A_DAY: Final = 24
HOURS_A_WEEK: Final = 7 * HOURS_A_DAY
# What may be of a share that is to be 0.9; a model that is wrong is soon farther off.
LEAST_SHARE: Final = 0.8
# Scans of one hour hang together: fewer prove nothing.
LEAST_SCANS: Final = 40


@dataclass(frozen=True, slots=True)
class Tally:
    """Scans that were predicted without their tag and its neighbours, and those that lay inside."""

    scans: int = 0
    inside: int = 0

    @property
    def share(self) -> float | None:
        """Inside; None: nothing was predicted."""
        return self.inside / self.scans if self.scans else None


@dataclass(frozen=True, slots=True)
class Record:
    """How a sensor's estimates have done; `since_ns` is when the first was compared."""

    since_ns: int | None
    day: Tally
    week: Tally

    @property
    def is_trusted(self) -> bool | None:
        """Whether day and week lay inside often enough; None: too few scans to say."""
        enough = [one for one in (self.day, self.week) if one.scans >= LEAST_SCANS]
        return all(one.inside >= LEAST_SHARE * one.scans for one in enough) if enough else None


@dataclass(slots=True)
class Grades:
    """One sensor's, by the hour; `day_length_s` is a day of the greenhouse, s of ROS time."""

    day_length_s: float
    _since_ns: int | None = None
    _hours: dict[int, Tally] = field(default_factory=dict)

    def add(self, graded: Tally, now_ns: int) -> None:
        """So many were compared now; nothing is later, whatever a clock showed before."""
        if not graded.scans:
            return
        hour = self._hour(now_ns)
        self._hours = {
            when: tally for when, tally in self._hours.items() if hour - HOURS_A_WEEK < when <= hour
        }
        was = self._hours.get(hour, Tally())
        self._hours[hour] = Tally(was.scans + graded.scans, was.inside + graded.inside)
        self._since_ns = now_ns if self._since_ns is None else min(self._since_ns, now_ns)

    def record(self, now_ns: int) -> Record:
        """As of now."""
        hour = self._hour(now_ns)
        return Record(self._since_ns, self._sum(hour, HOURS_A_DAY), self._sum(hour, HOURS_A_WEEK))

    def _sum(self, hour: int, hours: int) -> Tally:
        those = [one for when, one in self._hours.items() if hour - hours < when <= hour]
        return Tally(sum(one.scans for one in those), sum(one.inside for one in those))

    def _hour(self, now_ns: int) -> int:
        return int(now_ns / (self.day_length_s / HOURS_A_DAY * NANOSECONDS_PER_SECOND))
