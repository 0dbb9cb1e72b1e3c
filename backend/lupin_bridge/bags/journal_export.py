"""A period of a journal as a recording of the messages that made it."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from lupin_bridge.bags import journal_messages
from lupin_bridge.bags.bag_file import BagFile
from lupin_bridge.bags.topics import Topic
from lupin_twin.journal.reading import listed_rows
from lupin_twin.journal.rows import PinRow, Row
from lupin_twin.journal.runs import Run, runs, spans_within
from lupin_twin.journal.schema import LOCAL_SITE, one_view
from lupin_twin.parameters import TwinParameters
from lupin_twin.state import Pose

# Rows that are read in one go, in one short transaction: the log may not grow meanwhile for long.
LOT: Final = 2_000

_TABLES: Final = ("scan", "look", "place")


class JournalRows:
    """The writes with `start_ns <= stamp < end_ns`.

    `places` are those that tags have before: by an earlier write, or an earlier run of the clock.
    """

    def __init__(self, connection: sqlite3.Connection, start_ns: int, end_ns: int) -> None:
        self._connection = connection
        self._period = {"site": LOCAL_SITE, "start": start_ns, "end": end_ns, "lot": LOT}
        with one_view(connection):
            self._spans = spans_within(runs(connection.execute), start_ns, end_ns)
            self.runs: dict[int, Run] = {span.run.id: span.run for span in self._spans}
            self.places = self._places_before(start_ns)

    @property
    def is_simulated(self) -> bool:
        """Whether any of it goes by a clock that was simulated."""
        return any(run.begun.is_simulated for run in self.runs.values())

    def __iter__(self) -> Iterator[tuple[Run, Row]]:
        """Each with the run of the clock that it belongs to."""
        after = 0
        while True:
            with one_view(self._connection):
                found, last = self._lot(after)
            yield from found
            if last is None:
                return
            after = last

    def _places_before(self, start_ns: int) -> list[PinRow]:
        first: dict[str, PinRow] = {}
        for run in self.runs.values():
            for _, pin, is_copy in self._pins(run):
                if is_copy or pin.stamp_ns < start_ns:
                    first.setdefault(pin.tag_id, pin)
        return list(first.values())

    def _lot(self, after: int) -> tuple[list[tuple[Run, Row]], int | None]:
        """The next rows by their numbers, and the number of the last; None: that is all."""
        asked: dict[str, Any] = self._period | {"after": after}
        numbers = [
            [
                seq
                for (seq,) in self._connection.execute(
                    f"SELECT seq FROM {table} WHERE site = :site AND seq > :after"  # noqa: S608
                    " AND stamp_ns >= :start AND stamp_ns < :end AND is_copy = 0"
                    " ORDER BY seq LIMIT :lot",
                    asked,
                )
            ]
            for table in _TABLES
        ]
        last = min((found[-1] for found in numbers if len(found) == LOT), default=None)
        scans, looks, places = (
            [seq for seq in found if last is None or seq <= last] for found in numbers
        )
        within: list[tuple[int, Run, Row]] = []
        for run in self.runs.values():
            rows: list[tuple[int, Row]] = list(listed_rows(self._connection, run.id, scans, looks))
            rows += [(seq, pin) for seq, pin, _ in self._pins(run) if seq in places]
            within += [(seq, run, row) for seq, row in rows if self._holds(run, row.stamp_ns)]
        within.sort(key=lambda entry: entry[0])
        return [(run, row) for _, run, row in within], last

    def _pins(self, run: Run) -> Iterator[tuple[int, PinRow, bool]]:
        for seq, tag, stamp_ns, arrival_ns, is_copy, *pose in self._connection.execute(
            "SELECT seq, tag, stamp_ns, arrival_ns, is_copy, x, y, z, qx, qy, qz, qw FROM place"
            " WHERE site = :site AND run = :run ORDER BY seq",
            self._period | {"run": run.id},
        ):
            yield seq, PinRow(tag, stamp_ns, arrival_ns, Pose(*pose)), bool(is_copy)

    def _holds(self, run: Run, stamp_ns: int) -> bool:
        return any(
            span.run.id == run.id and span.start_ns <= stamp_ns < span.end_ns
            for span in self._spans
        )


_OBSERVATIONS, _TAGS, _CLOCK = range(3)
# Of so many messages the chunks reach the file together.
_FLUSH_EVERY: Final = 1_000


@dataclass(frozen=True, slots=True)
class Exported:
    """How many messages of each kind."""

    observations: int
    tags: int


def export(
    connection: sqlite3.Connection, path: Path, start_ns: int, end_ns: int, namespace: str = ""
) -> Exported:
    """Write what was heard with `start_ns <= stamp < end_ns` into a new file.

    A message is logged when it arrived, by the wall clock, as a recorder would have. Places that
    tags had before come first. Where time was simulated, `/clock` tells it before each message.
    Where nothing was heard no file is left.

    Raises:
        OSError: the file cannot be made or written, and there is none then; FileExistsError: it is
            there already.
        LookupError: the message types are not installed.

    """
    rows = JournalRows(connection, start_ns, end_ns)
    file = BagFile(path, _topics(namespace, has_clock=rows.is_simulated))
    with ExitStack() as otherwise:
        otherwise.callback(path.unlink)
        otherwise.callback(file.close)
        written = _write(file, rows)
        file.finish()
        file.flush_rest()
        otherwise.pop_all()
    file.close()
    if not written.observations + written.tags:
        path.unlink()
    return written


def _topics(namespace: str, *, has_clock: bool) -> list[Topic]:
    names = TwinParameters()
    root = f"/{namespace.strip('/')}/".replace("//", "/")
    topics = [
        Topic(root + names.observations_topic, "lupin_msgs/msg/Observation", 50),
        Topic(root + names.discovered_tags_topic, "lupin_msgs/msg/DiscoveredTags", 50),
        Topic("/clock", "rosgraph_msgs/msg/Clock"),
    ]
    return topics if has_clock else topics[:_CLOCK]


def _write(file: BagFile, rows: JournalRows) -> Exported:
    counts = [0, 0]
    for run, row in rows:
        at_ns = row.arrival_ns
        if run.begun.is_simulated:
            # What ROS time was when it arrived.
            now_ns = max(row.stamp_ns, at_ns - run.begun.arrival_ns + run.begun.stamp_ns)
            file.write(_CLOCK, at_ns, at_ns, journal_messages.clock(now_ns))
        if rows.places and not sum(counts):
            file.write(_TAGS, at_ns, at_ns, journal_messages.discovered(rows.places))
            counts[_TAGS] += 1
        if isinstance(row, PinRow):
            topic, data = _TAGS, journal_messages.discovered([row])
        else:
            topic, data = _OBSERVATIONS, journal_messages.observation(row)
        file.write(topic, at_ns, at_ns, data)
        counts[topic] += 1
        if sum(counts) % _FLUSH_EVERY == 0:
            file.flush()
    observations, tags = counts
    return Exported(observations, tags)
