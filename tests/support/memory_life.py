"""A twin over a file, without ROS, with clocks and observations by hand."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from lupin_twin.core import ingest
from lupin_twin.core.drops import Drop
from lupin_twin.core.state import Flower, Observation, Pose, Snapshot, TagState, TwinStore
from lupin_twin.field.idw import never
from lupin_twin.journal.fold import state_at
from lupin_twin.journal.runs import Clock
from lupin_twin.runtime.memory import Memory, open_journal
from tests.support.waiting import wait_for

S = 1_000_000_000
NOW = 1_900_000_000 * S
HERE = Pose(1.0, 2.0, 0.0, 0.0, 0.0, 0.0, 1.0)
THERE = Pose(5.0, 6.0, 0.0, 0.0, 0.0, 0.0, 1.0)
NOWHERE = Pose(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class Twin:
    """One run of a twin over a file, without ROS; the test sets its clocks."""

    def __init__(
        self,
        path: Path | None,
        at_s: float,
        *,
        is_simulated: bool = False,
        wall_s: float | None = None,
    ) -> None:
        self.store = TwinStore()
        self.steady_s = 1_000.0
        self.is_simulated = is_simulated
        self.memory = Memory(
            self.store, open_journal(path, "/twin", 1e4, 1e4), lambda: int(self.steady_s * S)
        )
        self.at(at_s, wall_s=wall_s)

    def at(self, at_s: float, *, passed_s: float = 0.0, wall_s: float | None = None) -> None:
        """Set the clock to `at_s`, s after `NOW`; `passed_s` by the steady clock.

        A simulated clock counts from 0, and the wall clock may be elsewhere.
        """
        self.steady_s += passed_s
        self.now_ns = int(at_s * S) + (0 if self.is_simulated else NOW)
        self.wall_ns = NOW + int((at_s if wall_s is None else wall_s) * S)
        now = Clock(self.now_ns, self.wall_ns, self.is_simulated)
        self.memory.follow(now)
        self.memory.clamp_to(now)

    def receive(
        self,
        stamp_s: float | None,
        *,
        tag: str = "7",
        source: str = "a",
        pose: Pose = NOWHERE,
        status: int = 0,
        flower: Flower | None = None,
        **readings: float,
    ) -> None:
        """Receive an observation now, with this stamp; with a flower it is an inspection."""
        stamp_ns = 0 if stamp_s is None else int(stamp_s * S)
        stamp_ns += 0 if self.is_simulated or stamp_s is None else NOW
        of: dict[str, Any] = {
            "pose": pose,
            "status": status,
            "source": source,
            "own_stamp_ns": stamp_ns,
        }
        sent = Observation(tag, 0, readings, kind=int(flower is not None), flower=flower, **of)
        write = ingest.observation("", sent, "map", self.now_ns)
        assert not isinstance(write, Drop)
        assert self.memory.apply(write, self.wall_ns) is None

    def doubts(self) -> bool:
        return self.memory.is_clock_doubted

    @property
    def live(self) -> dict[str, TagState]:
        return by_id(self.store.snapshot(self.now_ns, "map"))

    def past(self, at_s: float | None = None) -> dict[str, TagState]:
        """The log's state at a moment, by default now."""
        wait_for(lambda: self.memory.condition.waiting == 0, "all to be written")
        offset_ns = 0 if self.is_simulated else NOW
        at_ns = self.now_ns if at_s is None else int(at_s * S) + offset_ns
        return by_id(self.memory.recall.answer(lambda log, _: state_at(log, at_ns, "map"), never))

    def reading(self, name: str = "t", tag: str = "7") -> tuple[float, float | None]:
        """A sensor's value and age, the same live and in the log."""
        # A clock that has just gone back may not have its run in the log yet.
        wait_for(lambda: self.live == self.past(), "the log to say what is known live")
        [reading] = [r for r in self.live[tag].readings if r.name == name]
        assert reading.observed_at_ns is not None
        return reading.value, (self.now_ns - reading.observed_at_ns) / S


def by_id(snapshot: Snapshot) -> dict[str, TagState]:
    return {tag.tag_id: tag for tag in snapshot.tags}


@contextmanager
def twin(path: Path | None, at_s: float = 0.0, **of: Any) -> Iterator[Twin]:
    """One run, with a simulated clock or another wall clock (`Twin`)."""
    life = Twin(path, at_s, **of)
    try:
        yield life
    finally:
        life.memory.close()
