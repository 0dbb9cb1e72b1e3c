"""Questions about the past as values, so that another process may answer them.

`past_child` answers them, over a journal: it gives each what it looks up there.
"""

from __future__ import annotations

import pickle
import sqlite3
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

from lupin_twin.core.history import LatestRequest
from lupin_twin.core.journal_condition import Condition
from lupin_twin.core.notes import NotesRequest
from lupin_twin.core.past import (
    PastRow,
    PeriodRequest,
    RecentRequest,
    ScansRequest,
    SeriesRequest,
    WritesRequest,
)
from lupin_twin.journal.queries import Export, lots
from lupin_twin.runtime.workers import ShouldStop

ResultT = TypeVar("ResultT")
ResultT_co = TypeVar("ResultT_co", covariant=True)


class Step(Protocol):
    """What reads the log by itself, such as an export."""

    def step(self, log: sqlite3.Connection) -> Any:
        """What was found."""


# A moment, ns of ROS time, which `Snapshot` answers; a series, which `SeriesPast` does; what was
# recent at a moment, or scanned up to one, which a tuple of `PastWrite` does; what was received, or
# observed in a period, which `PastWrites` does; what people said, which `PastNotes` does; a tag's
# last scans, which a `History` does; or any other step.
Need = (
    int
    | SeriesRequest
    | RecentRequest
    | ScansRequest
    | WritesRequest
    | PeriodRequest
    | NotesRequest
    | LatestRequest
    | Step
)
# Looks up what is needed of the log, as of one moment of its writing.
Find = Callable[[Need], Any]


@dataclass(frozen=True, slots=True)
class Now:
    """What a question is about: ROS time, ns; the frame of poses; and how the journal is."""

    stamp_ns: int
    frame_id: str
    condition: Condition


class PastQuery(Protocol[ResultT_co]):
    """A value that can be pickled, and so can its answer."""

    def answer(self, find: Find, should_stop: ShouldStop) -> ResultT_co:
        """The answer; it ends early where `should_stop` says that nobody waits for it."""


@dataclass(frozen=True, slots=True)
class Itself:
    """The question whose answer is what was found, as it is."""

    need: Need

    def answer(self, find: Find, should_stop: ShouldStop) -> Any:  # noqa: ARG002
        """See `PastQuery`."""
        return find(self.need)


@dataclass(frozen=True, slots=True)
class ExportStep(Generic[ResultT]):
    """The next lots of an export, each through `write`, and the export behind them; None: its end.

    `export` is pickled: nobody looks at it between two steps.
    """

    export: bytes
    write: Callable[[Sequence[PastRow]], ResultT]

    def answer(
        self,
        find: Find,
        should_stop: ShouldStop,  # noqa: ARG002
    ) -> tuple[bytes | None, list[ResultT]]:
        """See `PastQuery`."""
        export: Export = pickle.loads(self.export)  # noqa: S301  # our own
        rows: list[PastRow] | None = find(export)
        if rows is None:
            return None, []
        return pickle.dumps(export, 5), [self.write(lot) for lot in lots(rows)]
