"""Questions about the past as values, so that another process may answer them.

A question says one by one what it has to know of the log, and with the last of that what is left
to do. `past_child` drives it, over a journal.
"""

from __future__ import annotations

import pickle
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from typing import Any, Final, Generic, Protocol, TypeVar

from lupin_twin.core.journal_condition import Condition
from lupin_twin.core.notes import NotesRequest
from lupin_twin.core.past import PastRow, SeriesRequest
from lupin_twin.core.writes import RecentRequest, WritesRequest
from lupin_twin.journal.queries import Export, lots
from lupin_twin.runtime.workers import ShouldStop

ResultT = TypeVar("ResultT")

# A moment, ns of ROS time, which `Snapshot` answers; a series, which `SeriesPast` does; what was
# recent at a moment, which a tuple of `PastWrite` does; what was received, which `PastWrites` does;
# what people said, which `PastNotes` does; the next step of an export, which a list of `PastRow`
# does.
Need = int | SeriesRequest | RecentRequest | WritesRequest | NotesRequest | Export
# What is known as of then crosses by itself, so it is of any type.
Found = Any
# What writing a row of an export takes, roughly and at worst, s.
WRITE_ROW_S: Final = 5e-6


@dataclass(frozen=True, slots=True)
class Now:
    """What a question is about: ROS time, ns; the frame of poses; and how the journal is."""

    stamp_ns: int
    frame_id: str
    condition: Condition


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


@dataclass(frozen=True, slots=True)
class ExportStep(Generic[ResultT]):
    """The next lots of an export, each through `write`, and the export behind them; None: its end.

    `export` is pickled: nobody looks at it between two steps.
    """

    export: bytes
    write: Callable[[Sequence[PastRow]], ResultT]

    def look(self) -> Generator[Need, Found, Work[tuple[bytes | None, list[ResultT]]]]:
        """See `Question`."""
        export: Export = pickle.loads(self.export)  # noqa: S301  # our own
        rows: list[PastRow] | None = yield export
        if rows is None:
            return Work(0.0, lambda _: (None, []))
        behind = pickle.dumps(export, 5)
        return Work(
            len(rows) * WRITE_ROW_S, lambda _: (behind, [self.write(lot) for lot in lots(rows)])
        )
