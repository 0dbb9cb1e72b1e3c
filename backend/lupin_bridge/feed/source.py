"""What the routes need of a twin, wherever it runs.

What the robot says of itself: where it is, where it has been, its plan, its battery. Of now alone:
nothing of it is in the journal. Times are ROS time, ns; positions m in the map frame.
"""

from __future__ import annotations

import asyncio
import math
import time
from abc import ABC, abstractmethod
from collections.abc import AsyncGenerator, Awaitable, Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Final, TypeVar

from lupin_bridge.feed.past_process import PastProcess
from lupin_bridge.feed.query import Now, PastQuery, as_found, export_step
from lupin_bridge.feed.relay import Relay, TwinNames
from lupin_twin.core.diagnostics import UNKNOWN_JOURNAL, Condition, Origin
from lupin_twin.core.drops import Counts, Recent
from lupin_twin.core.notes import Note, NotesRequest, NotesUnwritable, PastNotes
from lupin_twin.core.parameters import World
from lupin_twin.core.past import FOREVER_NS, NotRemembered, PastRow, PastWrites, WritesRequest
from lupin_twin.core.state import NANOSECONDS_PER_SECOND, Scan, Snapshot
from lupin_twin.field.engine import FieldRules
from lupin_twin.field.explored import OccupancyMap
from lupin_twin.journal.received import NOTES_S, STRETCH_S, WRITES_S, Export
from lupin_twin.runtime.estimates import Report, ReportRequest
from lupin_twin.runtime.workers import Workers

# A stamp that is farther ahead of the twin's time was made by a clock that is wrong.
MAX_AHEAD_NS: Final = 10 * NANOSECONDS_PER_SECOND
# Of the trail: how far back, how close, how many. Past that, what is older is made coarser.
TRAIL_NS: Final = 3600 * NANOSECONDS_PER_SECOND
TRAIL_STEP_M: Final = 0.1
TRAIL_STEP_NS: Final = NANOSECONDS_PER_SECOND
TRAIL_POINTS: Final = 720
# A plan that nobody repeats is none any more after so long, or once the robot is where it ends.
PLAN_NS: Final = 600 * NANOSECONDS_PER_SECOND
ARRIVED_M: Final = 0.5


@dataclass(frozen=True, slots=True)
class Position:
    """Where the robot was at `at_ns`; `heading` from x towards y, rad; None: it does not say."""

    x: float
    y: float
    heading: float | None
    at_ns: int


@dataclass(frozen=True, slots=True)
class Plan:
    """The way that the robot means to take, as of `at_ns`; without points: none."""

    points: tuple[tuple[float, float], ...]
    at_ns: int


@dataclass(frozen=True, slots=True)
class Battery:
    """How full the battery was at `at_ns`, 0 to 100."""

    percent: float
    at_ns: int


@dataclass(frozen=True, slots=True)
class Robot:
    """What is known of a robot; None: it has not said, or it does not hold any more."""

    position: Position | None = None
    plan: Plan | None = None
    battery: Battery | None = None


ValueT = TypeVar("ValueT", Position, Plan, Battery)


class RobotLog:
    """The newest of each, and the trail of the last hour, bounded."""

    def __init__(self) -> None:
        self.now = Robot()
        self.trail: list[Position] = []
        # Whether the robot has been away from where its plan ends: a round ends where it begins.
        self._was_away = False

    def take(self, heard: Robot, now_ns: int | None) -> bool:
        """Take what was heard since the last time; returns whether anything is another now.

        `now_ns` is the twin's time; None: it is not known. A clock that has gone back makes all
        unknown that would be of the future.
        """
        before = self.now
        future_ns = FOREVER_NS if now_ns is None else now_ns + MAX_AHEAD_NS
        if now_ns is not None:
            past_ns = now_ns - TRAIL_NS
            self.trail = [it for it in self.trail if past_ns <= it.at_ns <= future_ns]
        position = _newest(before.position, heard.position, future_ns)
        if position is not None and position is heard.position:
            self._extend(position)
        known = _newest(before.plan, None, future_ns)
        plan = _newest(known, heard.plan, future_ns)
        if plan is not None and plan is heard.plan and not (known and _same_end(known, plan)):
            self._was_away = False
        battery = _newest(before.battery, heard.battery, future_ns)
        self.now = Robot(position, self._pending(plan, position, now_ns), battery)
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

    def _pending(
        self, plan: Plan | None, position: Position | None, now_ns: int | None
    ) -> Plan | None:
        if plan is None or not plan.points:
            return None
        if now_ns is not None and plan.at_ns < now_ns - PLAN_NS:
            return None
        if position is None or position.at_ns < plan.at_ns:
            return plan
        x, y = plan.points[-1]
        is_away = math.hypot(position.x - x, position.y - y) > ARRIVED_M
        self._was_away |= is_away
        return None if self._was_away and not is_away else plan


def _same_end(a: Plan, b: Plan) -> bool:
    return bool(a.points and b.points) and math.dist(a.points[-1], b.points[-1]) <= ARRIVED_M


def _newest(known: ValueT | None, heard: ValueT | None, future_ns: int) -> ValueT | None:
    """What holds of the two; what was known is not, if it would be of the future."""
    if known is not None and known.at_ns > future_ns:
        known = None
    if known is None or (heard is not None and heard.at_ns >= known.at_ns):
        return heard
    return known


# --- what the routes need of a twin ---------------------------------------------------------------

ResultT = TypeVar("ResultT")

# What a callback may take at worst, on a slow machine: the largest state there is takes a second.
STUCK_AFTER_S: Final = 10.0

ELSEWHERE: Final = (
    "this bridge only reads the log; notes are written at the bridge of the process that keeps the "
    "journal, `lupin-twin serve`"
)


class TwinUnavailableError(RuntimeError):
    """The twin cannot answer now: it is not there, or it took too long."""


class TwinTimeoutError(TwinUnavailableError):
    """The twin took too long for an answer."""


@dataclass(frozen=True, slots=True)
class TwinUpdate:
    """All that the ROS thread tells the loop, as of one moment; immutable.

    `revision` is the snapshot's, `twin_count` how many nodes publish the state, `made_s` when it
    was told (monotonic clock). `counts` is what the twin dropped, lost and met; None: it does not
    say. `own_counts` is the same of a node of ours that is not the twin; `rules` are those of a
    twin in this process; `journal` is the twin's, wherever it is, as far as that tells. So are
    `origin`, where its observations come from, and `input_problems`, why it does not hear all of
    what is published for it. `silent_s` is for how long the twin has been silent, where it was so
    before this was told; 0: it is live.
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
        """What was dropped or lost lately, by the twin and then by a node of ours."""
        theirs = () if self.counts is None else self.counts.recent
        ours = () if self.own_counts is None else self.own_counts.recent
        return theirs + tuple(replace(drop, message=f"web: {drop.message}") for drop in ours)


@dataclass(frozen=True, slots=True)
class ThreadState:
    """How the ROS thread behind a source does; as it is here, where there is none.

    `stuck_s` is how long it has not answered a heartbeat, s, 0 between two; `calls_waiting` are
    calls to it, `callback_errors` those met by callbacks so far, as of the last heartbeat.
    """

    is_alive: bool = True
    stuck_s: float = 0.0
    calls_waiting: int = 0
    callback_errors: int = 0


class TwinSource(ABC):
    """A twin in this process, one elsewhere, or what an archive has of one; and its log.

    Everything here is called on the event loop. `workers` is where this process does what takes
    longer than a tick; `stop` closes it. `relay` is where ROS topics are listened to as they are on
    the wire. `past` reads the log; what is observed within the journal's 100 ms may be missing.
    """

    past: PastProcess
    workers: Workers
    relay: Relay
    timeout_s: float
    # What was told last, or is newer than that by a map.
    update: TwinUpdate | None = None
    # The twin's: how fields are made; so many of a tag's last scans are told; names in ROS.
    rules: FieldRules
    buffer_len: int
    names: TwinNames
    # Who is named where an answer takes too long.
    answerer = "the twin"
    # A `RosThread`, or what is said where there is none.
    thread: Any = ThreadState()
    # Tells the counts of one process from another's; empty where revisions are digests.
    identity = ""

    @abstractmethod
    async def start(
        self, on_state: Callable[[TwinUpdate], None], on_death: Callable[[], None]
    ) -> None:
        """Start; `on_state` gets every change (the newest, where they come fast)."""

    @abstractmethod
    async def stop(self) -> None:
        """Stop and release everything."""

    @property
    def world(self) -> World:
        """What is observed, as far as the twin or its log says; a demo's day is shorter."""
        return World("unknown")

    def revision(self) -> str:
        """The revision now: opaque, changes exactly when a field could; empty: nothing has come.

        What a call brings from a twin is never newer: what has changed is told at once.
        """
        return "" if self.update is None else self.update.revision

    @abstractmethod
    def journal(self) -> Condition:
        """How the twin's journal does, as far as it tells."""

    def occupancy_map(self) -> OccupancyMap | None:
        """The latest map, if any has come."""
        return None if self.update is None else self.update.occupancy_map

    @abstractmethod
    async def estimate_report(self, request: ReportRequest) -> Report:
        """What a sensor's estimates are worth.

        Raises:
            TwinUnavailableError: nobody there to say.

        """

    async def robot(self, now_ns: int | None) -> Robot | None:  # noqa: ARG002  # for who hears one
        """What the robot has said since this was last asked; None: here it is never heard.

        `now_ns` is the twin's time; None: it is not known.

        Raises:
            TwinUnavailableError: nobody there to hear it any more.

        """
        return None

    # --- the past; each may raise `PastRefused`, `NotRemembered` or `TwinUnavailableError` --------

    @abstractmethod
    async def now(self) -> Now:
        """At what a question is asked, and of which log, once that is known."""

    async def _explain(self, error: NotRemembered) -> NotRemembered:
        """The error as the caller gets it."""
        return error

    async def ask(self, question: PastQuery[ResultT], cost_s: float) -> ResultT:
        """The answer to a question; `cost_s` estimates all that it takes, s of one core."""
        now = await self.now()
        try:
            return await self._in_time(self.past.ask(question, now, cost_s))
        except NotRemembered as error:
            raise await self._explain(error) from None

    async def writes(self, request: WritesRequest) -> PastWrites:
        """What was heard, scan by scan and look by look, in the order of hearing."""
        return await self.ask(partial(as_found, request), WRITES_S)

    async def notes(self, request: NotesRequest) -> PastNotes:
        """What people said."""
        return await self.ask(partial(as_found, request), NOTES_S)

    # Only the process that keeps the journal writes it.
    writes_notes = False

    async def write_note(self, note: Note) -> Note:
        """Write a note; returns it with its id once it is in the journal.

        Raises:
            NotesUnwritable: it was not written.

        """
        raise NotesUnwritable(f"the note of {note.by} cannot be written: {ELSEWHERE}")

    # Whether there is a node to publish by.
    takes_observations = False

    async def publish_observation(self, scan: Scan) -> None:
        """Publish readings over ROS, as a robot does; whether the twin takes them is the twin's.

        Raises:
            TwinUnavailableError: there is no node.

        """
        raise TwinUnavailableError(f"readings of {scan.source} at {scan.tag_id} have no way to ROS")

    async def rows(
        self,
        start_ns: int,
        end_ns: int,
        tag_id: str | None,
        sensor_type: str | None,
        write: Callable[[Sequence[PastRow]], ResultT],
    ) -> AsyncGenerator[ResultT]:
        """Every reading and failed attempt of a period, at the pace of whoever takes them.

        They come in lots, each through `write`, which is called in another process. None: all tags,
        all sensors.
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
    """What is wrong with the thread behind a source so that only a restart helps; None: nothing."""
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
    """The rows of a period, lot by lot through `write`; the next ones are asked for as it is taken.

    `ask` asks the process that reads the past.
    """
    export: Export | None = period
    while export is not None:
        export, lots = await ask(partial(export_step, export, write))
        for lot in lots:
            yield lot
