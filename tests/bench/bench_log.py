"""The log: the cost of writing it, its size, and the time of its answers.

Times are those of one core; the first call over a connection of its own, and the median of more.
A greenhouse of 30 tags with five sensors is scanned for a year, every 48 minutes; one of 10,000
tags in two days, four times.
"""

import sqlite3
import statistics
import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import closing
from itertools import islice
from pathlib import Path
from typing import Final

from lupin_twin.core.past import EVERY_TAG, Event, SeriesRequest
from lupin_twin.core.state import Observation, TwinStore, Write
from lupin_twin.journal.file import JournalFile
from lupin_twin.journal.fold import state_at
from lupin_twin.journal.queries import series
from lupin_twin.journal.runs import Clock
from lupin_twin.journal.schema import open_reader
from lupin_twin.journal.writer import Journal
from lupin_twin.journal.writes import rows as exported
from lupin_twin.runtime.memory import Memory
from tests.bench.journal_double import BEGUN_NS, LIMITS, Filled, Greenhouse, filled

YEAR: Final = Greenhouse(tags=30, days=365.0, every_s=2880.0)
# The largest: 10,000 tags with five sensors each, every ten minutes.
MANY: Final = Greenhouse(tags=10_000, days=2.0, every_s=43_200.0, inspection_days=0.0, failing=0)
DAY: Final = Greenhouse(tags=10_000, days=1.0, every_s=600.0)
SCANS: Final = 60_000
# Scans that share a commit where the writer has to catch up.
LOT: Final = 500
TIMELINE: Final = (
    Event.SCANS, Event.FAILURES, Event.INSPECTIONS, Event.PESTS_SEEN, Event.PESTS_CLEARED,
    Event.SILENCES, Event.RUNS,
)  # fmt: skip


def main() -> None:
    with tempfile.TemporaryDirectory(prefix="lupin-twin-log-") as folder:
        write(Path(folder))
    request(filled(YEAR), filled(MANY))
    restart(filled(MANY))


def report(what: str, figure: str, requested: str) -> None:
    print(f"{what:58}{figure:>26}   (limit {requested})", flush=True)


def write(folder: Path) -> None:
    received = DAY.rows()
    # The first scan of each tag creates its series, once.
    before = list(islice(received, DAY.tags * 2))
    reported = list(islice(received, SCANS))
    paced = list(islice(received, 2_000))
    path = folder / "log.sqlite"
    file = JournalFile(path, LIMITS)
    with closing(file):
        run = file.start(Clock(BEGUN_NS, BEGUN_NS, is_simulated=False), is_believed=True).run

        def commit(lot: Sequence[Write]) -> None:
            file.append([(run, row) for row in lot])
            while file.check_size(may_purge=True):
                pass

        def size() -> int:
            with closing(sqlite3.connect(path)) as beside:
                beside.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchall()
            return path.stat().st_size

        def in_lots(rows: Sequence[Write], lot: int) -> None:
            for first in range(0, len(rows), lot):
                commit(rows[first : first + lot])

        in_lots(before, LOT)
        first_bytes = size()
        begun_s = time.process_time()
        in_lots(reported, LOT)
        rate = readings(reported) / (time.process_time() - begun_s)
        report("readings written a second", f"{rate:,.0f}", "100,000")
        each = (size() - first_bytes) / readings(reported)
        report("bytes a reading in the file", f"{each:.1f}", "20")
        begun_bytes = handed_to_disk()
        in_lots(paced, 1)
        size()
        each = (handed_to_disk() - begun_bytes) / readings(paced)
        report("bytes handed to the disk, each, a commit a scan", f"{each:,.0f}", "1,000")


def readings(rows: Sequence[Write]) -> int:
    return sum(len(row.readings) for row in rows if isinstance(row, Observation))


def handed_to_disk() -> int:
    """What this process has written by system calls (`wchar`)."""
    lines = Path("/proc/self/io").read_text(encoding="ascii").splitlines()
    return int(dict(line.split(": ") for line in lines)["wchar"])


def request(year: Filled, many: Filled) -> None:
    begin, end = BEGUN_NS, year.greenhouse.end_ns
    for greenhouse, requested in ((year, "3"), (many, "60")):
        at_ns = (BEGUN_NS + greenhouse.greenhouse.end_ns) // 2
        with closing(open_reader(greenhouse.path)) as reader:
            assert len(state_at(reader, at_ns, "map").tags) == greenhouse.greenhouse.tags
        report(
            f"state as of a moment, {greenhouse.greenhouse.tags:,} tags, ms",
            timed(greenhouse.path, lambda log, at_ns=at_ns: state_at(log, at_ns, "map")),  # type: ignore[misc]
            requested,
        )
    sensor = SeriesRequest("7", "temperature", begin, end)
    what = f"one sensor of {year.greenhouse.scans:,} scans as 500 buckets, ms"
    report(what, timed(year.path, lambda log: series(log, sensor, end)), "10")

    def timeline(log: object) -> None:
        for event in TIMELINE:
            series(log, SeriesRequest(EVERY_TAG, event, begin, end), end)

    what = f"timeline of {year.greenhouse.days:g} days, {year.readings:,} readings, ms"
    report(what, timed(year.path, timeline), "15")
    with closing(open_reader(many.path)) as reader:
        begun_s = time.process_time()
        count = sum(map(len, exported(reader, BEGUN_NS, many.greenhouse.end_ns)))
        rate = count / (time.process_time() - begun_s)
    report("readings exported a second", f"{rate:,.0f}", "-")


def timed(path: Path, query: Callable[[object], object]) -> str:
    """Ms of one core: the first over a connection, and the median of nine."""
    took = []
    with closing(open_reader(path)) as reader:
        for _ in range(9):
            begun_s = time.thread_time()
            query(reader)
            took.append((time.thread_time() - begun_s) * 1e3)
    return f"{took[0]:.2f}, then {statistics.median(took):.2f}"


def restart(many: Filled) -> None:
    store, end_ns = TwinStore(), many.greenhouse.end_ns
    begun_s, used_s = time.perf_counter(), time.process_time()
    journal = Journal(many.path, "/bench/lupin_twin", LIMITS)
    try:
        memory = Memory(store, journal)
        memory.follow(Clock(end_ns, end_ns, is_simulated=False))
        took = time.perf_counter() - begun_s, time.process_time() - used_s
        assert len(store.snapshot(end_ns, "map").tags) == many.greenhouse.tags
    finally:
        journal.close(60.0)
    report("restart with 10,000 tags, s; of one core", f"{took[0]:.2f}; {took[1]:.2f}", "1.6")
