"""`TwinSource`, the routes' interface to a twin, wherever it runs; and the log of the robot.

`RobotLog` has the robot's position, trail, plan and battery. They are current values only: the
journal has none of them. Times are ROS time, ns; positions are m in the map frame.
"""

from __future__ import annotations

import asyncio
import math
import time
from abc import ABC, abstractmethod
from collections.abc import AsyncGenerator, Awaitable, Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from operator import methodcaller
from typing import Any, Final, TypeVar

from lupin_bridge.feed.past_process import PastProcess
from lupin_bridge.feed.query import Now, PastQuery, export_step
from lupin_bridge.feed.relay import Relay, TwinNames
from lupin_twin.core.diagnostics import UNKNOWN_JOURNAL, Condition, Origin
from lupin_twin.core.drops import Counts, Recent
from lupin_twin.core.notes import Note, NotesRequest, NotesUnwritable, PastNotes
from lupin_twin.core.parameters import World
from lupin_twin.core.past import FOREVER_NS, NotRemembered, PastRow, PastWrites, WritesRequest
from lupin_twin.core.state import NANOSECONDS_PER_SECOND, Observation, Snapshot
from lupin_twin.field.engine import FieldRules
from lupin_twin.field.explored import OccupancyMap
from lupin_twin.journal.writes import NOTES_S, STRETCH_S, WRITES_S, Export
from lupin_twin.runtime.workers import Workers

# A stamp farther ahead of the twin's time than this comes from a wrong clock.
MAX_AHEAD_NS: Final = 10 * NANOSECONDS_PER_SECOND
# Limits of the trail: its age, the distance and time between points, their number. A full trail
# loses every second point of its older half.
TRAIL_NS: Final = 3600 * NANOSECONDS_PER_SECOND
TRAIL_STEP_M: Final = 0.1
TRAIL_STEP_NS: Final = NANOSECONDS_PER_SECOND
TRAIL_POINTS: Final = 720
# A plan expires this long after it was published, and is not shown within ARRIVED_M of its end.
PLAN_NS: Final = 600 * NANOSECONDS_PER_SECOND
ARRIVED_M: Final = 0.5


@dataclass(frozen=True, slots=True)
class Position:
    """Where the robot was at `at_ns`; `heading` is rad from x towards y; None: not reported."""

    x: float
    y: float
    heading: float | None
    at_ns: int


@dataclass(frozen=True, slots=True)
class Plan:
    """The path that the robot plans to take, as of `at_ns`; no points: it has no plan."""

    points: tuple[tuple[float, float], ...]
    at_ns: int


@dataclass(frozen=True, slots=True)
class Battery:
    """The battery's charge at `at_ns`, percent, 0 to 100."""

    percent: float
    at_ns: int


@dataclass(frozen=True, slots=True)
class Robot:
    """What is known of a robot; None: not reported, or no longer valid."""

    position: Position | None = None
    plan: Plan | None = None
    battery: Battery | None = None


ValueT = TypeVar("ValueT", Position, Plan, Battery)


class RobotLog:
    """The newest position, plan and battery, and a bounded trail of the last hour."""

    def __init__(self) -> None:
        self.now = Robot()
        self.trail: list[Position] = []
        # Also while the robot is at its end, where a round begins too.
        self._plan: Plan | None = None

    def take(self, reported: Robot, now_ns: int | None) -> bool:
        """Take what was received since the last call; returns whether anything has changed.

        `now_ns` is the twin's time; None: not known. Values stamped in the future become unknown:
        the clock has gone back.
        """
        before = self.now
        future_ns = FOREVER_NS if now_ns is None else now_ns + MAX_AHEAD_NS
        if now_ns is not None:
            past_ns = now_ns - TRAIL_NS
            self.trail = [it for it in self.trail if past_ns <= it.at_ns <= future_ns]
        position = _newest(before.position, reported.position, future_ns)
        if position is not None and position is reported.position:
            self._extend(position)
        self._plan = _newest(self._plan, reported.plan, future_ns)
        battery = _newest(before.battery, reported.battery, future_ns)
        self.now = Robot(position, self._pending(position, now_ns), battery)
        return self.now != before

    def _extend(self, position: Position) -> None:
        if self.trail:
            last = self.trail[-1]
            apart_m = math.hypot(position.x - last.x, position.y - last.y)
            if position.at_ns < last.at_ns + TRAIL_STEP_NS or apart_m < TRAIL_STEP_M:
                return
        self.trail.append(position)
        if len(self.trail) > TRAIL_POINTS:
            del self.trail[1 : TRAIL_POINTS // 2 : 2]

    def _pending(self, position: Position | None, now_ns: int | None) -> Plan | None:
        plan = self._plan
        if plan is None or not plan.points:
            return None
        if now_ns is not None and plan.at_ns < now_ns - PLAN_NS:
            return None
        is_there = position and math.dist((position.x, position.y), plan.points[-1]) <= ARRIVED_M
        return None if is_there else plan


def _newest(known: ValueT | None, reported: ValueT | None, future_ns: int) -> ValueT | None:
    """The newer of the two; a known value stamped in the future is dropped."""
    if known is not None and known.at_ns > future_ns:
        known = None
    if known is None or (reported is not None and reported.at_ns >= known.at_ns):
        return reported
    return known


# --- the interface to a twin ----------------------------------------------------------------------

ResultT = TypeVar("ResultT")

# No callback takes this long, even on a slow machine: the largest possible state takes a second.
STUCK_AFTER_S: Final = 10.0

ELSEWHERE: Final = (
    "this bridge cannot write notes: write them at the bridge of the process that keeps the "
    "journal, `lupin-twin serve`"
)


class TwinUnavailableError(RuntimeError):
    """The twin cannot answer now: it is not there, or it took too long."""


class TwinTimeoutError(TwinUnavailableError):
    """The twin took too long for an answer."""


@dataclass(frozen=True, slots=True)
class TwinUpdate:
    """All that a source reports to the event loop, as of one moment; immutable.

    `revision` is the snapshot's. `twin_count` is how many nodes publish the state. `made_s` is when
    this was made (monotonic clock). `counts` is what the twin dropped, lost and met; None: not
    reported. `own_counts` is the same for our own node, where that is not the twin. `rules` are the
    field rules. The twin reports `journal`, its journal's condition; `origin`, where its
    observations come from; and `input_problems`, why it misses messages. `silent_s` is for how long
    the twin had been silent when this was made; 0: it was live.
    """

    snapshot: Snapshot
    revision: str
    twin_count: int = 1
    occupancy_map: OccupancyMap | None = None
    counts: Counts | None = None
    own_counts: Counts | None = None
    journal: Condition = UNKNOWN_JOURNAL
    rules: FieldRules | None = None
    origin: Origin = "unknown"
    input_problems: tuple[str, ...] = ()
    made_s: float = field(default_factory=time.monotonic, compare=False)
    silent_s: float = 0.0

    @property
    def drops(self) -> tuple[Recent, ...]:
        """Recent drops and losses: those of the twin, then those of our own node."""
        theirs = () if self.counts is None else self.counts.recent
        ours = () if self.own_counts is None else self.own_counts.recent
        return theirs + tuple(replace(drop, message=f"web: {drop.message}") for drop in ours)


@dataclass(frozen=True, slots=True)
class ThreadState:
    """The state of a source's ROS thread; the defaults stand for a source without one.

    `stuck_s` is for how long a heartbeat has been unanswered, s; 0 between two. `calls_waiting`
    counts calls to the thread. `callback_errors` counts errors, as of the last heartbeat.
    """

    is_alive: bool = True
    stuck_s: float = 0.0
    calls_waiting: int = 0
    callback_errors: int = 0


class TwinSource(ABC):
    """A twin and its log: in this process, in another one, or as an archive has it.

    Everything here is called on the event loop. `workers` runs work that would block the loop;
    `stop` closes it. `relay` passes on ROS topics as raw bytes. `past` reads the log, which may
    lack the last 100 ms: the journal writes in batches.
    """

    past: PastProcess
    workers: Workers
    relay: Relay
    timeout_s: float
    # The last update that was reported; it may have a newer map.
    update: TwinUpdate | None = None
    # The twin's field rules, how many of a tag's last scans it keeps, and its ROS names.
    rules: FieldRules
    buffer_len: int
    names: TwinNames
    # Named in the message of a time-out.
    answerer = "the twin"
    # A `RosThread`, or a `ThreadState` where there is none.
    thread: Any = ThreadState()
    # Distinguishes the revisions of two processes that count; empty where revisions are digests.
    identity = ""

    @abstractmethod
    async def start(
        self, on_state: Callable[[TwinUpdate], None], on_death: Callable[[], None]
    ) -> None:
        """Start; `on_state` gets every change, or only the newest of a fast series."""

    @abstractmethod
    async def stop(self) -> None:
        """Stop and release everything."""

    @property
    def world(self) -> World:
        """What the twin observes, as far as it or its log reports that; a demo's day is shorter."""
        return World("unknown")

    @property
    def problems(self) -> tuple[str, ...]:
        """Why nothing is received, where that is not the twin's own problem."""
        return ()

    def revision(self) -> str:
        """The current revision: opaque, changes exactly when a field could; empty: no state yet.

        No answer from the twin is newer, because changes are reported at once.
        """
        return "" if self.update is None else self.update.revision

    def journal(self) -> Condition:
        """The condition of the twin's journal, as far as it is reported."""
        return UNKNOWN_JOURNAL if self.update is None else self.update.journal

    def occupancy_map(self) -> OccupancyMap | None:
        """The latest map, if any has come."""
        return None if self.update is None else self.update.occupancy_map

    async def robot(self, now_ns: int | None) -> Robot | None:  # noqa: ARG002  # for RosSource
        """What the robot has reported since the last call; None: this source never receives it.

        `now_ns` is the twin's time; None: not known.

        Raises:
            TwinUnavailableError: the ROS thread has ended.

        """
        return None

    # --- the past; each may raise `PastRefused`, `NotRemembered` or `TwinUnavailableError` --------

    @abstractmethod
    async def now(self) -> Now:
        """The time and the log that a query refers to; waits until they are known."""

    async def _explain(self, error: NotRemembered) -> NotRemembered:
        """The error that the caller gets; a source may also start a repair."""
        return error

    async def ask(self, query: PastQuery[ResultT], cost_s: float) -> ResultT:
        """Answer a query about the past; `cost_s` is its estimated cost, s of one core."""
        now = await self.now()
        try:
            return await self._in_time(self.past.ask(query, now, cost_s))
        except NotRemembered as error:
            raise await self._explain(error) from None

    async def writes(self, request: WritesRequest) -> PastWrites:
        """The received scans and inspections, in the order of receipt."""
        return await self.ask(methodcaller("writes", request), WRITES_S)

    async def notes(self, request: NotesRequest) -> PastNotes:
        """The notes that people wrote."""
        return await self.ask(methodcaller("notes", request), NOTES_S)

    # Only the process that keeps the journal writes it.
    writes_notes = False

    async def write_note(self, note: Note) -> Note:
        """Write a note; returns it with its id once it is in the journal.

        Raises:
            NotesUnwritable: it was not written.

        """
        raise NotesUnwritable(f"the note of {note.by} cannot be written: {ELSEWHERE}")

    # Whether there is a ROS node that can publish.
    takes_observations = False

    async def publish_observation(self, scan: Observation) -> None:
        """Publish readings over ROS, as a robot does; the twin may still reject them.

        Raises:
            TwinUnavailableError: there is no node.

        """
        raise TwinUnavailableError(f"{scan.source}, {scan.tag_id}: no way to publish over ROS")

    async def rows(
        self,
        start_ns: int,
        end_ns: int,
        tag_id: str | None,
        sensor_type: str | None,
        write: Callable[[Sequence[PastRow]], ResultT],
    ) -> AsyncGenerator[ResultT]:
        """Yield every reading and failed attempt of a period, at the pace of the consumer.

        They come in lots, each converted by `write`, which runs in another process. `tag_id` and
        `sensor_type` None: all.
        """
        period = Export(start_ns, end_ns, tag_id, sensor_type)
        async for lot in exported(lambda step: self.ask(step, STRETCH_S), period, write):
            yield lot

    async def _in_time(self, answer: Awaitable[ResultT]) -> ResultT:
        try:
            async with asyncio.timeout(self.timeout_s):
                return await answer
        except TimeoutError:
            raise TwinTimeoutError(
                f"{self.answerer} did not answer within {self.timeout_s:g} s"
            ) from None


def ailment(thread: Any) -> str | None:
    """What is wrong with a source's thread that only a restart mends; None: nothing."""
    if not thread.is_alive:
        return "The ROS thread has ended. Restart."
    if thread.stuck_s >= STUCK_AFTER_S:
        return f"The ROS thread has been stuck in a callback for {thread.stuck_s:.0f} s. Restart."
    return None


async def exported(
    ask: Callable[
        [PastQuery[tuple[Export | None, list[ResultT]]]],
        Awaitable[tuple[Export | None, list[ResultT]]],
    ],
    period: Export,
    write: Callable[[Sequence[PastRow]], ResultT],
) -> AsyncGenerator[ResultT]:
    """Yield the rows of a period in lots, converted by `write`; queries the next ones when needed.

    `ask` queries the process that reads the past.
    """
    export: Export | None = period
    while export is not None:
        export, lots = await ask(partial(export_step, export, write))
        for lot in lots:
            yield lot
