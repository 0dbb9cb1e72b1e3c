"""The state as of a moment, and what a twin that starts takes to know all, out of the journal.

Each state is of another moment, over one connection, as a twin keeps it. "cold" is the very first,
"first" the first of a new connection. Beside that, what the demo takes to fill an empty journal
before its start.
"""

from __future__ import annotations

import os
import random
import statistics
import sys
import time
from contextlib import closing
from pathlib import Path
from tempfile import TemporaryDirectory

from lupin_bridge.demo import fill_past
from lupin_twin.history import History
from lupin_twin.journal.fold import state_at
from lupin_twin.journal.retention import Limits
from lupin_twin.journal.runs import Clock
from lupin_twin.journal.schema import open_reader
from lupin_twin.journal.writer import Journal
from lupin_twin.memory import Memory
from lupin_twin.state import TwinStore
from tests.bench.journal_double import (
    DAY_S,
    MONTH,
    QUICK_MONTH,
    QUICK_YEAR,
    SECOND,
    YEAR,
    House,
    filled,
)

# Tags and their readings alone, in one message or in three, of two days: how far back a journal
# goes is one step more in a tree.
ALONE = House(tags=10_000, days=2.0, every_s=43_200.0, look_days=0.0, failing=0)
IN_THREE = House(tags=10_000, days=2.0, every_s=43_200.0, sets=3, look_days=0.0, failing=0)


def moments(house: House, count: int) -> list[int]:
    """Some moments at which all tags are known."""
    chance = random.Random(7)
    known_ns = int(house.every_s) * SECOND
    span_ns = int(house.days * DAY_S) * SECOND - known_ns
    return [house.end_ns - int(chance.random() * span_ns) for _ in range(count)]


def states(what: str, house: House, times: int) -> None:
    """Print what a state takes: cold, at the first, at the median, and of one core."""
    journal = filled(house)
    wall, core = [], []
    cold_ns, *others = moments(house, times + 1)
    with closing(open_reader(journal.path)) as connection:
        start = time.perf_counter()
        state_at(connection, cold_ns, "map")
        cold_s = time.perf_counter() - start
    with closing(open_reader(journal.path)) as connection:
        for at_ns in others:
            start, begun = time.perf_counter(), time.thread_time()
            tags = len(state_at(connection, at_ns, "map").tags)
            wall.append((time.perf_counter() - start) * 1e3)
            core.append((time.thread_time() - begun) * 1e3)
            assert tags == house.tags
    print(
        f"{what:<44}{journal.readings:>12,}{cold_s * 1e3:>10.1f}{wall[0]:>10.1f}"
        f"{statistics.median(wall):>10.1f}{min(wall):>10.1f}{min(core):>10.1f}",
        flush=True,
    )


def start(path: Path, house: House) -> tuple[float, float]:
    """How long a twin that starts waits for what was known, s; and how much of one core that is."""
    store = TwinStore()
    journal = Journal(path, "/bench/lupin_twin", Limits(36_500.0, 10**12))
    try:
        begun, used = time.perf_counter(), time.process_time()
        memory = Memory(store, History(32), journal, 32)
        memory.follow(Clock(house.end_ns, house.end_ns, is_simulated=False))
        took = time.perf_counter() - begun, time.process_time() - used
        assert len(store.snapshot(house.end_ns, "map").tags) == house.tags
        return took
    finally:
        journal.close(60.0)


def fill() -> tuple[float, float]:
    """How long the demo takes to fill an empty journal with its past, s; and how much of a core."""
    with TemporaryDirectory() as folder:
        begun, used = time.perf_counter(), sum(os.times()[:4])
        assert fill_past(Path(folder) / "demo.sqlite", ())
        return time.perf_counter() - begun, sum(os.times()[:4]) - used


def main() -> None:
    """Print the tables."""
    is_quick = "--quick" in sys.argv
    times = 5 if is_quick else 20
    columns = ("readings", "cold", "first", "median", "best", "one core")
    heads = "".join(f"{column:>10}" for column in columns[1:])
    print(f"{'state as of a moment, ms':<44}{columns[0]:>12}{heads}")
    year, month = (QUICK_YEAR, QUICK_MONTH) if is_quick else (YEAR, MONTH)
    rows: tuple[tuple[str, House], ...] = (
        (f"{year.tags} tags, {year.days:g} days, looks", year),
        ("10,000 tags, five sensors", ALONE),
        ("10,000 tags, five sensors in three messages", IN_THREE),
        (f"10,000 tags, {month.days:g} days, looks and failures", month),
    )
    for what, house in rows:
        states(what, house, times)
    for house in (ALONE, month):
        took_s, core_s = start(filled(house).path, house)
        print(
            f"start of a twin, {house.tags:,} tags x five sensors: {took_s:.2f} s, of one core"
            f" {core_s:.2f} s",
            flush=True,
        )
    took_s, core_s = fill()
    print(f"three days of the demo's past: {took_s:.2f} s, of one core {core_s:.2f} s", flush=True)


if __name__ == "__main__":
    main()
