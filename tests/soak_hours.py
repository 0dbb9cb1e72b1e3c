"""Eight hours of a large greenhouse in a minute or two, by `make soak`; no part of the suite.

10,000 tags of five sensors, each scanned every ten minutes, through what a twin does without ROS:
store, history, journal and its maintenance. Time is the rows' own, as fast as the disk is.
"""

import gc
import os
import random
from collections.abc import Iterator
from pathlib import Path

from lupin_twin.core.state import Observation, Pose, TwinStore
from lupin_twin.journal.retention import Limits
from lupin_twin.journal.runs import Clock
from lupin_twin.journal.writer import Journal
from lupin_twin.runtime.memory import Memory
from tests.support.journal import NOW, SECOND, is_whole, select
from tests.support.proc_stat import resident_mb
from tests.support.waiting import wait_for

TAGS, EVERY_S, HOURS = 10_000, 600, 8
SENSORS = ("temperature", "humidity", "co2", "light", "soil_moisture")
LIMITS = Limits(days=36_500, max_bytes=10**11)
# The longest queue: observations must not be lost to a clock that runs 500 times too fast.
MOST_WAITING = 2_000


def scans(hour: int, chance: random.Random) -> Iterator[Observation]:
    """All scans of an hour, one tag after the other."""
    rounds = 3600 // EVERY_S
    step_ns = EVERY_S * SECOND // TAGS
    for at in range(hour * rounds, (hour + 1) * rounds):
        for tag in range(TAGS):
            values = {name: 20 + chance.random() for name in SENSORS}
            pose = Pose(tag / 100, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0)
            stamp_ns = NOW + (at * TAGS + tag) * step_ns
            yield Observation(
                str(tag), stamp_ns, values, pose, source="robot", own_stamp_ns=stamp_ns
            )


def test_memory_stays_and_all_of_it_is_in_the_file(tmp_path: Path) -> None:
    """From the third hour on: by then everything bounded is full, SQLite's cache of 16 MB last."""
    chance, path, resident = random.Random(1), tmp_path / "j.sqlite", list[float]()
    journal = Journal(path, "/soak", LIMITS)
    memory = Memory(TwinStore(), journal)
    memory.follow(Clock(NOW, NOW, is_simulated=False))
    for hour in range(HOURS):
        for scan in scans(hour, chance):
            assert memory.apply(scan, scan.stamp_ns) is None
            wait_for(lambda: journal.condition.waiting <= MOST_WAITING, "room for more")
        wait_for(lambda: not journal.condition.waiting, "all of it written")
        gc.collect()
        resident.append(resident_mb(os.getpid()))
        size_mb = journal.condition.file_bytes / 1e6
        print(f"hour {hour + 1}: {size_mb:.0f} MB with the log, {resident[-1]:.0f} MB resident")
    journal.close(60.0)  # the last fold may take longer than a twin would wait
    memory.close()
    assert max(resident) < 1.05 * max(resident[:3])
    assert is_whole(path)
    assert select(path, "SELECT count(*) FROM scan") == [(HOURS * TAGS * 3600 // EVERY_S,)]
