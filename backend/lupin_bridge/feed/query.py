"""Questions about the past as values, so that another process may answer them.

A question says one by one what it has to know, a state as of a moment or a series, and with
the last of that what is left to do. Who drives it knows the past: `past_child`, over a journal.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import Any, Final, Generic, Protocol, TypeVar

from lupin_twin.core.notes import NotesRequest
from lupin_twin.core.past import SeriesRequest
from lupin_twin.core.writes import RecentRequest, WritesRequest
from lupin_twin.runtime.workers import ShouldStop

ResultT = TypeVar("ResultT")

# A moment, ns of ROS time, which `Snapshot` answers; a series, which `SeriesPast` does; what was
# recent at a moment, which a tuple of `PastWrite` does; what was received, which `PastWrites` does;
# or what people said, which `PastNotes` does: only a journal knows that.
Need = int | SeriesRequest | RecentRequest | WritesRequest | NotesRequest
# What is known as of then crosses by itself, so it is of any type.
Found = Any
# What writing a row of an export takes, roughly and at worst, s.
WRITE_ROW_S: Final = 5e-6


@dataclass(frozen=True, slots=True)
class Work(Generic[ResultT]):
    """What is left when all is known, and about how long that takes, s of one core."""

    cost_s: float
    do: Callable[[ShouldStop], ResultT]


class Question(Protocol[ResultT]):
    """A value that can be pickled, and so can its answer."""

    def look(self) -> Generator[Need, Found, Work[ResultT]]:
        """Yield each need, get what was found, return the work."""


@dataclass(frozen=True, slots=True)
class Itself:
    """The question whose answer is what was found, as it is."""

    need: Need

    def look(self) -> Generator[Need, Found, Work[Any]]:
        """One need and no work."""
        found = yield self.need
        return Work(0.0, lambda _: found)
