"""Journals of a long time, written fast: the same rows as a twin's.

Each tag is scanned in its turn, every `every_s`, so that all tags have been by then. Every
tag has its position.
"""

import atexit
import math
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from functools import cache
from itertools import islice
from pathlib import Path
from typing import Final

from lupin_twin.core.state import Bloom, Flower, Observation, Pin, Pose, Write
from lupin_twin.journal.file import JournalFile
from lupin_twin.journal.retention import Limits
from lupin_twin.journal.runs import Clock

SECOND: Final = 1_000_000_000
DAY_S: Final = 86_400.0
BEGUN_NS: Final = 1_763_700_000 * SECOND
LIMITS: Final = Limits(days=36_500, max_bytes=10**12)
SENSORS: Final = ("temperature", "humidity", "co2", "light", "soil_moisture")
_BATCH: Final = 20_000


@dataclass(frozen=True)
class Greenhouse:
    """The received observations of a greenhouse.

    `inspection_days` : how often flowers are inspected, 0 for never; `failing`: every that many
    attempts fail, 0: none.
    """

    tags: int
    days: float
    every_s: float
    inspection_days: float = 1.0
    failing: int = 50

    @property
    def end_ns(self) -> int:
        """The end of the last day."""
        return BEGUN_NS + int(self.days * DAY_S) * SECOND

    @property
    def scans(self) -> int:
        """How often a tag is scanned."""
        return int(self.days * DAY_S / self.every_s)

    def rows(self) -> Iterator[Write]:
        step_ns = int(self.every_s * SECOND / self.tags)
        ids = [str(number + 1) for number in range(self.tags)]
        inspections_every = max(1, int(self.inspection_days * DAY_S / self.every_s))
        for turn in range(self.scans):
            by_day = math.sin(turn * self.every_s / DAY_S * 2.0 * math.pi)
            for tag, tag_id in enumerate(ids):
                at_ns = BEGUN_NS + int(turn * self.every_s) * SECOND + tag * step_ns
                arrival_ns = at_ns + 50_000_000
                if turn == 0:
                    yield Pin(tag_id, _place(tag), at_ns, arrival_ns)
                if self.failing and (turn * 7 + tag) % self.failing == 0:
                    yield Observation(
                        tag_id, at_ns, {}, None, 2, "no answer", "robot", at_ns, "", arrival_ns
                    )
                    continue
                base = round(20.0 + 4.0 * by_day + (tag * 37 + turn) % 16 / 8.0, 1)
                values = {name: base + 10.0 * index for index, name in enumerate(SENSORS)}
                yield Observation(
                    tag_id, at_ns, values, None, 0, "", "robot", at_ns, "patrol", arrival_ns
                )
                if self.inspection_days and turn % inspections_every == tag % inspections_every:
                    yield _inspection(tag, at_ns, has_pest=(turn + tag) % 97 == 0)


def _place(tag: int) -> Pose:
    return Pose(tag % 100 * 0.5, tag // 100 * 0.5, 0.3, 0.0, 0.0, 0.0, 1.0)


def _inspection(tag: int, at_ns: int, *, has_pest: bool) -> Observation:
    place = _place(tag)
    blooms = tuple(
        Bloom(place.x + n / 10, place.y + 0.1, 0.4, 0.25, "lupin", 0.9, anomaly=False)
        for n in range(2)
    )
    flower = Flower("lupin", 0.9, has_pest, 2, int(has_pest), blooms)
    sent = ("robot", at_ns + 1, "patrol", at_ns + 60_000_000)
    return Observation(str(tag + 1), at_ns + 1, {}, None, 0, "", *sent, 1, flower)


@dataclass(frozen=True)
class Filled:
    path: Path
    greenhouse: Greenhouse
    readings: int


@cache
def filled(greenhouse: Greenhouse) -> Filled:
    """The journal of a greenhouse, written once per process; it is deleted with the process."""
    return fill(
        _folder() / f"{greenhouse.tags}-{greenhouse.days:g}-{greenhouse.every_s:g}.sqlite",
        greenhouse,
    )


@cache
def _folder() -> Path:
    folder = Path(tempfile.mkdtemp(prefix="lupin-twin-bench-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


def fill(path: Path, greenhouse: Greenhouse) -> Filled:
    """Write all observations of a greenhouse, as its twin would."""
    readings = 0
    file = JournalFile(path, LIMITS)
    with closing(file):
        run = file.start(Clock(BEGUN_NS, BEGUN_NS, is_simulated=False), is_believed=True).run
        received = greenhouse.rows()
        while lot := list(islice(received, _BATCH)):
            file.append([(run, row) for row in lot])
            readings += sum(len(row.readings) for row in lot if isinstance(row, Observation))
            file.check_size(may_purge=False)
    return Filled(path, greenhouse, readings)
