"""Rows and journals for tests."""

import sqlite3
from collections.abc import Iterable, Iterator
from contextlib import closing, contextmanager
from dataclasses import replace
from pathlib import Path

from lupin_twin.core.diagnostics import Condition, JournalState
from lupin_twin.core.parameters import World
from lupin_twin.core.state import KIND_FLOWER, Bloom, Flower, Observation, Pin, Pose, Write
from lupin_twin.journal.file import JournalFile
from lupin_twin.journal.fold import Restored
from lupin_twin.journal.retention import Limits
from lupin_twin.journal.runs import Clock
from lupin_twin.journal.schema import Empty, open_reader
from lupin_twin.journal.writer import Journal
from tests.support.waiting import wait_for

SECOND = 1_000_000_000
NOW = 1_763_700_000 * SECOND
LIMITS = Limits(days=36_500, max_bytes=4_000_000_000)
CLOCK = Clock(NOW, NOW, is_simulated=False)


def scan(
    tag_id: str = "7", at_ns: int = NOW, *, source: str = "robot", **readings: float
) -> Observation:
    return Observation(
        tag_id,
        at_ns,
        readings or {"temperature": 21.5},
        source=source,
        own_stamp_ns=at_ns,
        mission="m1",
        arrival_ns=at_ns + 1000,
    )


def inspection(tag_id: str = "7", at_ns: int = NOW, *, anomaly: bool = False) -> Observation:
    """An inspection of two flowers."""
    flower = Flower(
        species="lupin",
        confidence=0.9,
        anomaly=anomaly,
        flower_count=2,
        bug_count=int(anomaly),
        blooms=(
            Bloom(1.1, 2.2, 0.3, 0.25, "lupin", 0.8, anomaly=False),
            Bloom(1.2, 2.1, 0.4, 0.5, "rose", 0.7, anomaly=anomaly),
        ),
        footprint=((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.1)),
    )
    reported = {"source": "robot", "mission": "m1", "arrival_ns": at_ns + 2000}
    return Observation(tag_id, at_ns, kind=KIND_FLOWER, flower=flower, **reported)  # type: ignore[arg-type]


def pin(tag_id: str = "7", at_ns: int = NOW, x: float = 1.5) -> Pin:
    return Pin(tag_id, Pose(x, 2.5, 0.0, 0.0, 0.0, 0.0, 1.0), at_ns, at_ns + 1000)


def past_write(number: int, run: int, row: Observation) -> Observation:
    """A row as queries of the log return it."""
    flower = row.flower and replace(row.flower, blooms=(), footprint=())
    return replace(row, number=number, run=run, pose=None, flower=flower)


@contextmanager
def opened(path: Path, limits: Limits = LIMITS) -> Iterator[JournalFile]:
    """A journal's file, in this thread."""
    file = JournalFile(path, limits)
    try:
        yield file
    finally:
        file.close()


_LAST_RUN = (
    "SELECT run, is_simulated, begun_stamp_ns, begun_arrival_ns FROM run WHERE joins IS NULL"
    " ORDER BY run DESC LIMIT 1"
)
_LAST = (
    "SELECT stamp_ns, arrival_ns FROM scan JOIN series USING (site, series) WHERE run = {0}"
    " UNION ALL SELECT stamp_ns, arrival_ns FROM look WHERE run = {0}"
    " ORDER BY stamp_ns DESC LIMIT 1"
)


def _now(path: Path) -> Clock:
    """The last arrival in the last run; `NOW` where there is none."""
    with closing(open_reader(path)) as connection:
        for run, is_simulated, begun_ns, arrival_ns in connection.execute(_LAST_RUN):
            latest = connection.execute(_LAST.format(run)).fetchone() or (0, 0)
            stamp_ns, arrival_ns = max((begun_ns, arrival_ns), latest)  # noqa: PLW2901
            return Clock(stamp_ns, arrival_ns, bool(is_simulated))
    return CLOCK


def append(path: Path, rows: Iterable[Write], now: Clock | None = None) -> int:
    """Write rows, in one run of a twin; returns the result of `JournalFile.append`."""
    with opened(path) as file:
        run = file.start(now or _now(path), is_believed=True).run
        return file.append([(run, row) for row in rows])


def restored(path: Path, now: Clock | None = None) -> Restored:
    """What a twin that starts now restores."""
    with opened(path) as file:
        return file.start(now or _now(path), is_believed=False)


def known(path: Path, now: Clock | None = None) -> set[Write]:
    """The same as the rows that it may come from."""
    found = restored(path, now)
    rows: set[Write] = set(found.rows)
    for tag in found.known.tags:
        if tag.pose is not None:
            stamp_ns = found.known.placed_ns[tag.tag_id]
            rows.add(Pin(tag.tag_id, tag.pose, stamp_ns, stamp_ns + 1000))
    return rows


def select(path: Path, sql: str) -> list[tuple[object, ...]]:
    """A query of a reader; nothing while the file does not exist yet."""
    if not path.exists():
        return []
    try:
        connection = open_reader(path)
    except Empty:
        return []
    try:
        return connection.execute(sql).fetchall()
    finally:
        connection.close()


def is_whole(path: Path) -> bool:
    connection = sqlite3.connect(path)
    try:
        return connection.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
    finally:
        connection.close()


@contextmanager
def recording(
    path: Path, now: Clock = CLOCK, *, limits: Limits = LIMITS, world: World = World()
) -> Iterator[Journal]:
    journal = Journal(path, "/test/lupin_twin", limits, world=world)
    try:
        journal.begin(now)
        yield journal
    finally:
        journal.close(30.0)


def wait_state(journal: Journal, state: JournalState, part: str = "") -> Condition:
    """Wait until the journal is in a state, with a part of its message."""

    def check() -> Condition | None:
        condition = journal.condition
        return condition if condition.state is state and part in condition.detail else None

    found = wait_for(check, f"a journal that is {state.value} ({part}): {journal.condition}")
    assert found is not None
    return found
