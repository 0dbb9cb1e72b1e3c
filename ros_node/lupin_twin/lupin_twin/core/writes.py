"""What was received, write by write, in that order: for followers of a journal. Pure.

A request with the number of the last write gets what has come since, late observations
too, and nothing twice. Times are nanoseconds of ROS time.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from lupin_twin.core.past import PastRefused

DEFAULT_WRITES: Final = 1_000
MAX_WRITES: Final = 2_000
# The largest that SQLite counts to.
MAX_NUMBER: Final = 2**63 - 1
# Of each tag, what is recent at a moment: its last scans and inspections, so many of each, and no
# older.
RECENT_COUNT: Final = 9
RECENT_NS: Final = 3 * 86_400 * 1_000_000_000
# Scans of one answer: some seconds of one core.
MAX_SCANS: Final = 200_000


@dataclass(frozen=True, slots=True)
class WritesRequest:
    """Writes with a number above `after`, at most `max_count`; 0: from the beginning.

    From the beginning, what was received more than `reach_s` before now is left out, and all but
    the newest `reach_count` writes; 0: nothing is.

    Raises:
        PastRefused: a number that cannot be, or more than is given.

    """

    after: int = 0
    reach_s: float = 0.0
    reach_count: int = 0
    max_count: int = DEFAULT_WRITES

    def __post_init__(self) -> None:
        """Refuse what cannot be answered."""
        if self.after < 0 or self.reach_count < 0:
            raise PastRefused(f"after or reach_count is {min(self.after, self.reach_count)}, not 0")
        if self.after > MAX_NUMBER:
            raise PastRefused(f"after is {self.after}, the limit is {MAX_NUMBER}")
        if not 0.0 <= self.reach_s <= 1e9:
            raise PastRefused(f"reach_s is {self.reach_s}, the limits are 0 and 1e9 s")
        if not 1 <= self.max_count <= MAX_WRITES:
            raise PastRefused(f"max_count is {self.max_count}, the limits are 1 and {MAX_WRITES}")


@dataclass(frozen=True, slots=True)
class RecentRequest:
    """What was recent at a moment, ns of ROS time: see `RECENT_COUNT`.

    Of the run that has the moment, without the copies that a run begins with. The answer is a tuple
    of `PastWrite`, by stamp and number: scans with readings, inspections that saw flowers.
    """

    at_ns: int


@dataclass(frozen=True, slots=True)
class ScansRequest:
    """All scans of one of `sensors` from `since_ns` to `at_ns`, both included, ns of ROS time.

    Of the run that has `at_ns`, without copies. The answer is a tuple of `PastWrite`, by stamp and
    number; it is empty if there are more than `MAX_SCANS`.
    """

    since_ns: int
    at_ns: int
    sensors: frozenset[str]


@dataclass(frozen=True, slots=True)
class PeriodRequest:
    """All that was observed in `start_ns <= stamp < end_ns`, by stamp and number, without copies.

    The answer is `PastWrites`. Who requests it knows that it is not too much at once.
    """

    start_ns: int
    end_ns: int


@dataclass(frozen=True, slots=True)
class PastWrite:
    """One scan or inspection, or an attempt; `kind` and `status` as in lupin_msgs/Observation.

    `sensors` and `values` have one length. `has_seen`: it saw the flowers; the last three
    are what it saw. A species that the camera was not sure of is left out.
    """

    number: int
    run: int
    tag_id: str
    stamp_ns: int
    kind: int
    status: int
    sensors: tuple[str, ...] = ()
    values: tuple[float, ...] = ()
    has_seen: bool = False
    species: str = ""
    anomaly: bool = False
    bug_count: int = 0


@dataclass(frozen=True, slots=True)
class RunSpan:
    """A stretch of the axis of time, `start_ns <= stamp < end_ns`, and the run that has it."""

    run: int
    start_ns: int
    end_ns: int


def recent_of(writes: Iterable[PastWrite], at_ns: int) -> tuple[PastWrite, ...]:
    """What is recent at a moment, of writes of one run in any order."""
    by_tag: dict[tuple[str, int], list[PastWrite]] = {}
    for write in writes:
        is_in_time = at_ns - RECENT_NS <= write.stamp_ns <= at_ns
        if is_in_time and (write.values or write.has_seen):
            by_tag.setdefault((write.tag_id, write.kind), []).append(write)
    found: list[PastWrite] = []
    for mine in by_tag.values():
        mine.sort(key=_in_time)
        stamps = sorted({write.stamp_ns for write in mine})[-RECENT_COUNT:]
        found += [write for write in mine if write.stamp_ns >= stamps[0]]
    return tuple(sorted(found, key=_in_time))


def _in_time(write: PastWrite) -> tuple[int, int]:
    return write.stamp_ns, write.number


@dataclass(frozen=True, slots=True)
class PastWrites:
    """Some writes, in the order of their numbers; ask on after `last`, until `is_all`.

    `journal` identifies the file: numbers of two are not comparable.
    """

    journal: str
    spans: tuple[RunSpan, ...]
    writes: tuple[PastWrite, ...]
    last: int
    is_all: bool
