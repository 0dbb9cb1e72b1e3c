"""Eight hours of a large greenhouse in a minute or two: memory stays, and all of it is in the file.

10,000 tags of five sensors, each scanned every ten minutes, through what a twin does without ROS:
store, history, journal and its maintenance. Time is the rows' own, as fast as the disk is.
"""

import gc
import os
import random
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from lupin_twin.core.state import Pose, Reading, Scan, TwinStore
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


def scans(hour: int, chance: random.Random) -> Iterator[Scan]:
    """All scans of an hour, one tag after the other."""
    rounds = 3600 // EVERY_S
    step_ns = EVERY_S * SECOND // TAGS
    for at in range(hour * rounds, (hour + 1) * rounds):
        for tag in range(TAGS):
            values = (Reading(name, 20 + chance.random()) for name in SENSORS)
            pose = Pose(tag / 100, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0)
            stamp_ns = NOW + (at * TAGS + tag) * step_ns
            yield Scan(
                str(tag), stamp_ns, tuple(values), pose, source="robot", own_stamp_ns=stamp_ns
            )


def main(hours: int = HOURS) -> bool:
    """Write; returns whether memory stays within a twentieth, and the file is whole.

    Counted from the third hour on: by then everything bounded is full, with SQLite's cache of
    16 MB filled last.
    """
    chance, begun_s = random.Random(1), time.monotonic()
    resident: list[float] = []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "j.sqlite"
        journal = Journal(path, "/soak", LIMITS)
        memory = Memory(TwinStore(), journal)
        memory.follow(Clock(NOW, NOW, is_simulated=False))
        for hour in range(hours):
            for scan in scans(hour, chance):
                assert memory.apply(scan, scan.stamp_ns) is None
                wait_for(lambda: journal.condition.waiting <= MOST_WAITING, "room for more", 60.0)
            wait_for(lambda: not journal.condition.waiting, "all of it written", 60.0)
            gc.collect()
            resident.append(resident_mb(os.getpid()))
            found = journal.condition
            count = (hour + 1) * TAGS * 3600 // EVERY_S
            print(
                f"hour {hour + 1}: {count:,} scans, {found.file_bytes / 1e6:.0f} MB with the log,"
                f" {resident[-1]:.0f} MB resident, lost {found.lost},"
                f" {time.monotonic() - begun_s:.0f} s",
                flush=True,
            )
        journal.close(60.0)  # the last fold may take longer than a twin would wait
        memory.close()
        size, whole = path.stat().st_size, is_whole(path)
        ((stored,),) = select(path, "SELECT count(*) FROM scan")
    readings = count * len(SENSORS)
    print(
        f"{stored} scans of {count} in the file, whole: {whole}; {size / readings:.1f} bytes a"
        f" reading; resident up to the third hour {max(resident[:3]):.0f} MB, up to the end"
        f" {max(resident):.0f} MB"
    )
    is_flat = max(resident) < 1.05 * max(resident[:3])
    return is_flat and whole and stored == count
