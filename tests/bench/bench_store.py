"""The journal beside a plain table of readings and DuckDB: writing, its cost on the disk, asking.

One core, one process. Times are those of that core (the process's own), so that a busy machine
tells nearly the same; a disk that has to be waited for is not in them. A day of the largest
house, 10,000 tags with five sensors every ten minutes, is 7.2 million readings; a share of it is
written, the first scan of each tag beforehand. `--quick`: small ones; `--share 1`: the whole day.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from itertools import islice
from pathlib import Path
from typing import Final, TypeVar

from lupin_twin.journal.export import rows
from lupin_twin.journal.file import JournalFile
from lupin_twin.journal.fold import state_at
from lupin_twin.journal.queries import series
from lupin_twin.journal.rows import Row, ScanRow
from lupin_twin.journal.runs import Clock
from lupin_twin.journal.schema import open_reader
from lupin_twin.journal.writer import Journal
from lupin_twin.past import EVERY_TAG, Event, SeriesRequest
from tests.bench.journal_double import (
    BEGUN_NS,
    DAY_S,
    LIMITS,
    MONTH,
    QUICK_MONTH,
    QUICK_YEAR,
    SECOND,
    SENSORS,
    YEAR,
    House,
    filled,
)
from tests.bench.store_rivals import Duck, Plain, Reading, Rival

# 10,000 tags every ten minutes, one after the other: 16.7 scans a second.
DAY: Final = House(tags=10_000, days=1.0, every_s=600.0)
DAY_READINGS: Final = 7_200_000
# Scans that share a commit where the writer has to catch up, and where it keeps pace.
LOT: Final = 500
PACE: Final = 1
T = TypeVar("T")


def main(arguments: Sequence[str] = ()) -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--share", type=float, default=0.1)
    options = parser.parse_args(arguments)
    share = 0.01 if options.quick else options.share
    with tempfile.TemporaryDirectory(prefix="lupin-twin-store-") as folder:
        writing(Path(folder), share)
        hand_over(Path(folder))
    asking("30 tags", QUICK_YEAR if options.quick else YEAR)
    asking("10,000 tags", QUICK_MONTH if options.quick else MONTH)


# --- writing ------------------------------------------------------------------------------------


def writing(folder: Path, share: float) -> None:
    heard = DAY.rows()
    before = list(islice(heard, DAY.tags * 2))
    scans = int(DAY_READINGS * share / len(SENSORS))
    told = [row for row in islice(heard, scans) if isinstance(row, ScanRow)]
    paced = [row for row in islice(heard, 2_000) if isinstance(row, ScanRow)]
    parts = (before, told, paced)
    print(f"{scans * 5:,} readings, {share:g} of a day of 10,000 tags; one core")
    print(f"{'':14}  readings/s  at the end  % of a core  bytes each  written each, bytes")
    journal = JournalFile(folder / "journal.sqlite", LIMITS, is_sound=True)
    with closing(journal):
        run = journal.start(Clock(BEGUN_NS, BEGUN_NS, is_simulated=False), 1, is_believed=True).run

        def write(lot: Sequence[Row]) -> None:
            journal.append([(run, row) for row in lot])
            # All that comes with it: the log put into the file.
            while journal.look_after(may_purge=True):
                pass

        def size() -> int:
            # The log is as long for a day as for an hour.
            journal._connection.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchall()
            return (folder / "journal.sqlite").stat().st_size

        report("journal", parts, write, size)
    for make in (Plain, Duck):
        rival: Rival = make(folder / make.__name__)

        def commit(lot: Sequence[Row], rival: Rival = rival) -> None:
            readings = list(readings_of(lot))
            if readings:
                rival.commit(readings)

        report(rival.name, parts, commit, rival.size)
        rival.close()


def report(
    name: str,
    heard: tuple[Sequence[Row], Sequence[ScanRow], Sequence[ScanRow]],
    write: Callable[[Sequence[Row]], None],
    size: Callable[[], int],
) -> None:
    before, told, paced = heard
    write(before)
    first_bytes = size()
    rates = []
    begun_s = time.process_time()
    for tenth in lots(told, -(-len(told) // 10)):
        tenth_s = time.process_time()
        for lot in lots(tenth, LOT):
            write(lot)
        rates.append(count(tenth) / (time.process_time() - tenth_s))
    rate = count(told) / (time.process_time() - begun_s)
    each = (size() - first_bytes) / count(told)
    begun_bytes = written_bytes()
    for lot in lots(paced, PACE):
        write(lot)
    size()
    written = (written_bytes() - begun_bytes) / count(paced)
    core = 100.0 * DAY_READINGS / DAY_S / rate
    print(f"{name:14}  {rate:10,.0f}  {rates[-1]:10,.0f}  {core:11.2f}", end="")
    print(f"  {each:10.1f}  {written:12,.0f}", flush=True)


def written_bytes() -> int:
    """What this process has handed to the system to write (`wchar`)."""
    lines = Path("/proc/self/io").read_text(encoding="ascii").splitlines()
    return int(dict(line.split(": ") for line in lines)["wchar"])


def count(told: Sequence[Row]) -> int:
    return sum(len(row.readings) for row in told if isinstance(row, ScanRow))


def lots(told: Sequence[T], size: int) -> Iterator[Sequence[T]]:
    for first in range(0, len(told), size):
        yield told[first : first + size]


def readings_of(told: Sequence[Row]) -> Iterator[Reading]:
    for row in told:
        if isinstance(row, ScanRow):
            for number, reading in enumerate(row.readings):
                series_id = (int(row.tag_id) - 1) * len(SENSORS) + number
                yield series_id, row.stamp_ns, reading.value


def hand_over(folder: Path) -> None:
    told = list(islice(DAY.rows(), 20_000))
    journal = Journal(folder / "handed.sqlite", "bench", LIMITS)
    journal.begin(Clock(BEGUN_NS, BEGUN_NS, is_simulated=False))
    times = []
    for row in told:
        at = time.perf_counter()
        journal.write(row)
        times.append((time.perf_counter() - at) * 1e6)
    journal.close(60.0)
    times.sort()
    print(
        f"\nhanding a row over, us: half {statistics.median(times):.1f},"
        f" 99 % {times[len(times) * 99 // 100]:.1f}"
    )


# --- asking -------------------------------------------------------------------------------------

_AS_OF: Final = {
    # Each series is one step in the key.
    "plain table": "SELECT s.series, ts, value FROM (SELECT DISTINCT series FROM reading) AS s"
    " JOIN reading AS r ON r.series = s.series AND r.ts ="
    " (SELECT max(ts) FROM reading WHERE series = s.series AND ts <= ?)",
    "DuckDB": "SELECT series, max(ts), arg_max(value, ts) FROM reading WHERE ts <= ?"
    " GROUP BY series",
}
_BUCKETS: Final = (
    "SELECT (ts - ?) / ? AS bucket, count(*), avg(value), min(value), max(value) FROM reading"
    " WHERE {} ts >= ? AND ts < ? GROUP BY bucket ORDER BY bucket"
)


def asking(name: str, house: House) -> None:
    made = filled(house)
    begin, end = BEGUN_NS, house.end_ns
    middle = begin + (end - begin) // 2
    width = -(-(end - begin) // 500)
    day = (middle, middle + int(DAY_S) * SECOND)
    reader = open_reader(made.path)
    columns: dict[str, list[float]] = {
        "journal": [
            timed(lambda: state_at(reader, middle, "map")),
            timed(lambda: series(reader, SeriesRequest("7", "temperature", begin, end), end)),
            timed(lambda: series(reader, SeriesRequest(EVERY_TAG, Event.SCANS, begin, end), end)),
            timed(
                lambda: series(reader, SeriesRequest(EVERY_TAG, Event.SILENCES, begin, end), end)
            ),
            timed(lambda: series(reader, SeriesRequest("7", "temperature", *day, 5000), end)),
            rate(lot for lot in rows(reader, begin, end)),
        ]
    }
    reader.close()
    restore_s = restored_s(made.path, end)
    sizes: dict[str, float] = {"journal": made.bytes / made.readings}
    with tempfile.TemporaryDirectory(prefix="lupin-twin-store-") as folder:
        for make in (Plain, Duck):
            rival: Rival = make(Path(folder) / make.__name__)
            rival.load(readings_of(list(house.rows())))
            columns[rival.name] = asked(rival, begin, end, width, day)
            sizes[rival.name] = rival.size() / made.readings
            rival.close()
    print(f"\n{name}, {house.days:g} days, {made.readings:,} readings; first call, ms")
    print(f"{'':46}" + "".join(f"{column:>14}" for column in columns))
    for number, what in enumerate(
        (
            "state as of the middle (journal: all of it)",
            "one sensor as 500 buckets",
            "timeline as 500 buckets",
            "silences",
            "one day's readings of a sensor",
            "export, readings/s",
        )
    ):
        print(f"{what:46}" + "".join(f"{told[number]:14,.1f}" for told in columns.values()))
    print(f"{'bytes a reading':46}" + "".join(f"{size:14,.1f}" for size in sizes.values()))
    print(f"{'restore, s':46}{restore_s:14,.2f}")


def asked(rival: Rival, begin: int, end: int, width: int, day: tuple[int, int]) -> list[float]:
    middle, one = day[0], 6 * len(SENSORS)
    return [
        timed(lambda: rival.ask(_AS_OF[rival.name], middle)),
        timed(lambda: rival.ask(_BUCKETS.format(f"series = {one} AND"), begin, width, begin, end)),
        timed(lambda: rival.ask(_BUCKETS.format(""), begin, width, begin, end)),
        float("nan"),
        timed(
            lambda: rival.ask(
                f"SELECT ts, value FROM reading WHERE series = {one}"
                " AND ts >= ? AND ts < ? ORDER BY ts",
                *day,
            )
        ),
        rate(rival.every("SELECT ts, series, value FROM reading ORDER BY ts", 1_000)),
    ]


def timed(ask: Callable[[], object]) -> float:
    """Of the first call, ms."""
    begun_s = time.process_time()
    ask()
    return (time.process_time() - begun_s) * 1e3


def rate(found: Iterator[Sequence[object]]) -> float:
    begun_s = time.process_time()
    return sum(map(len, found)) / (time.process_time() - begun_s)


def restored_s(path: Path, now_ns: int) -> float:
    begun_s = time.process_time()
    file = JournalFile(path, LIMITS, is_sound=True)
    with closing(file):
        file.start(Clock(now_ns, now_ns, is_simulated=False), 1, is_believed=True)
    return time.process_time() - begun_s


if __name__ == "__main__":
    main(sys.argv[1:])
