"""WebSocket frames of the state, each serialized once for all clients; and the twin's status.

Pure. A frame is serialized when the first client needs it, and cached for the others.

`Status` alone decides whether the twin behind the bridge is alive; all else reports that. Time is
an argument, s of a monotonic clock.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice
from typing import Any, Final, Literal

import orjson
from websockets.frames import Frame, Opcode

from lupin_bridge.alarms.board import Board, notes_of_alarms, worst_first
from lupin_bridge.feed.source import TwinUpdate
from lupin_bridge.judge.episodes import Alarm
from lupin_bridge.judge.judging import NOTHING_JUDGED, Judged
from lupin_bridge.stream.state_json import (
    StateJson,
    alarms_body,
    header,
    judgement,
    judgement_since,
    stamp,
)
from lupin_twin.core.diagnostics import Condition, JournalState
from lupin_twin.core.notes import Note
from lupin_twin.core.parameters import World
from lupin_twin.core.state import NANOSECONDS_PER_SECOND, ClockState, Snapshot, TagState

# The twin publishes at least once a second (parameter state_publish_rate_hz, default 1); three
# missed publications are no accident.
STALE_AFTER_S = 3.0

Reason = Literal[
    "live",
    "paused",
    "no_clock",
    "clock_stopped",
    "clock_doubted",
    "never_seen",
    "stale",
    "thread_dead",
    "shutting_down",
]
_OF_CLOCK: dict[ClockState, Reason] = {
    "running": "live",
    "paused": "paused",
    "stopped": "clock_stopped",
    "none": "no_clock",
    "doubted": "clock_doubted",
}

_MESSAGES: dict[Reason, str] = {
    "live": "The twin is live.",
    "paused": "The twin is live, and its simulated time is paused.",
    "no_clock": "The twin has no time: nothing has come on /clock yet. Ages are not known. "
    "Start the simulation, or the twin without use_sim_time.",
    "clock_stopped": "The twin's time has stopped: nothing comes on /clock any more. Ages are not "
    "known. Check the simulation.",
    "clock_doubted": "The twin's clock contradicts its journal or, in a fleet, is ahead of the "
    "archive's. Ages are not known. Set the clock.",
    "never_seen": "Nothing has been received from a twin yet. Start it, or check ROS_DOMAIN_ID.",
    "stale": "The twin has fallen silent. Check that its process runs and is reachable.",
    "thread_dead": "The bridge's ROS thread has ended. Restart the bridge.",
    "shutting_down": "The bridge is shutting down.",
}


NO_UPDATE = TwinUpdate(Snapshot(0, "", ()), "")


@dataclass(frozen=True, slots=True)
class Status:
    """Whether the twin is live, and why; with what else a status frame reports.

    `state_age_s` is the age of the last state, s; None: none has come. `update` is the twin's
    newest. `outward` maps each channel of notifications to its fault, in one line; empty: none.
    `day_length_s` is the length of the twin's day, s of ROS time: a demo's is shorter.
    """

    reason: Reason
    state_age_s: float | None
    update: TwinUpdate = NO_UPDATE
    outward: Mapping[str, str] = field(default_factory=dict)
    day_length_s: float = 86_400.0

    @property
    def is_live(self) -> bool:
        """Whether what the bridge serves is current."""
        return self.reason in ("live", "paused")

    @property
    def message(self) -> str:
        """The status in words, for a person."""
        twins = self.update.twin_count
        if self.is_live and twins > 1:
            return (
                f"{twins} twins publish on the same topic, and what you see is a mixture of them. "
                "Stop all but one, or give them ROS domains of their own."
            )
        return _MESSAGES[self.reason]

    def is_news_after(self, before: Status | None) -> bool:
        """Whether clients that were sent `before` must be notified."""
        return before is None or before.news() != self.news()

    def news(self) -> tuple[object, ...]:
        """What is sent at once when it changes; not a journal's backlog, which always changes."""
        now, journal = self.update, self.update.journal
        return (
            self.reason,
            self.message,
            now.occupancy_map is None,
            # The order of magnitude of each count: many drops must not cause many frames.
            {drop.reason: drop.count.bit_length() for drop in now.drops},
            journal.state,
            "" if journal.state == JournalState.SLOW else journal.detail,
            journal.quarantined,
            journal.simulated_ns,
            self.outward,
            now.origin,
            now.input_problems,
        )

    def frame(self) -> dict[str, Any]:
        """`schema.StatusFrame`."""
        now = self.update
        return {
            "type": "status",
            "twin": "live" if self.is_live else "offline",
            "reason": self.reason,
            "message": self.message,
            "state_age_seconds": None if self.state_age_s is None else round(self.state_age_s, 3),
            # Spares a browser requests whose 404 it would show as an error.
            "has_map": now.occupancy_map is not None,
            "origin": now.origin,
            "twin_count": now.twin_count,
            "input_problems": list(now.input_problems),
            "day_length_s": self.day_length_s,
            "drops": [
                {"reason": drop.reason, "message": drop.message, "count": drop.count}
                for drop in now.drops
            ],
            "journal": _journal(now.journal),
            "outward": [
                {"channel": channel, "is_failing": bool(detail), "detail": detail}
                for channel, detail in self.outward.items()
            ],
        }


NEVER_SEEN = Status("never_seen", None)


def _journal(journal: Condition) -> dict[str, Any]:
    simulated = journal.simulated_ns
    return {
        "state": journal.state.value,
        "detail": journal.detail,
        "set_aside": journal.quarantined,
        "simulated": simulated and {"start": stamp(simulated[0]), "end": stamp(simulated[1])},
    }


@dataclass(slots=True)
class Liveness:
    """The twin's newest update, when that came, and whether the thread still runs.

    `world()` is what the twin observes, and `problems()` why nothing comes, as far as they are
    known without an update.
    """

    world: Callable[[], World] = lambda: World("unknown")
    problems: Callable[[], tuple[str, ...]] = tuple
    stale_after_s: float = STALE_AFTER_S
    update: TwinUpdate | None = None
    updated_s: float = 0.0
    outward: Mapping[str, str] = field(default_factory=dict)
    thread_dead: bool = False
    shutting_down: bool = False

    def silent_s(self, now_s: float) -> float | None:
        """For how long the twin has been silent, s; None: nothing has ever come."""
        if self.update is None:
            return None
        # A site of an archive may have been silent already when its update came.
        return max(0.0, now_s - self.updated_s) + self.update.silent_s

    def status(self, now_s: float) -> Status:
        """The status at `now_s`."""
        age_s, world = self.silent_s(now_s), self.world()
        update = self.update or replace(
            NO_UPDATE, origin=world.origin, input_problems=self.problems()
        )
        return Status(self._reason(age_s), age_s, update, self.outward, world.day_length_s)

    def _reason(self, age_s: float | None) -> Reason:
        if self.shutting_down:
            return "shutting_down"
        if self.thread_dead:
            return "thread_dead"
        if age_s is None or self.update is None:
            return "never_seen"
        return _OF_CLOCK[self.update.snapshot.clock] if age_s < self.stale_after_s else "stale"


# --- frames of the state --------------------------------------------------------------------------


def text_frame(payload: bytes) -> bytes:
    """UTF-8 text as one WebSocket text frame; a server does not mask (RFC 6455, section 5.1)."""
    return Frame(Opcode.TEXT, payload).serialize(mask=False)


# Alarms in a frame at most: the worst active ones take precedence over those cleared recently.
MAX_IN_FRAME: Final = 1_000
RECENT_NS: Final = 86_400 * NANOSECONDS_PER_SECOND


def alarms_in_frame(board: Board, now_ns: int | None) -> list[Alarm]:
    """The alarms of a frame: those active now or within the last 24 h, newest first."""
    since_ns = 0 if now_ns is None else now_ns - RECENT_NS
    active = heapq.nsmallest(MAX_IN_FRAME, board.active, key=worst_first)
    over = (it for it in board.alarms if it.cleared_at_ns and it.cleared_at_ns >= since_ns)
    found = (*active, *islice(over, MAX_IN_FRAME - len(active)))
    return sorted(found, key=lambda alarm: (-alarm.raised_at_ns, alarm.id))


def alarms_message(now: Board, now_ns: int | None, notes: tuple[Note, ...], count: int) -> bytes:
    """`schema.AlarmsFrame`: the alarms with their notes; `count` is the number of all notes."""
    said = notes_of_alarms(now.alarms, notes, now_ns)
    body = alarms_body(alarms_in_frame(now, now_ns), now.source, now.since_ns, said)
    return text_frame(orjson.dumps({"type": "alarms", "notes": count, **body}))


@dataclass(slots=True, eq=False)
class StateFrame:
    """One numbered state, with its serialized forms for all clients.

    `base` is the frame before it, without a base of its own: a delta goes back by one frame.
    """

    seq: int
    revision: str
    snapshot: Snapshot
    judged: Judged
    base: StateFrame | None
    _writer: FrameWriter
    _wires: dict[str, bytes] = field(default_factory=dict)

    def message_json(self) -> bytes:
        """The state as JSON of lupin_msgs/TwinState, for clients of the ROS message."""
        return self._writer.message_json.state(self.snapshot, self.snapshot.now_ns)

    def let_go(self) -> None:
        """Keep only what a delta needs; else every frame ever made would stay in memory."""
        self.base = None
        self._wires.clear()

    def full(self) -> bytes:
        """`schema.StateFrame` as a WebSocket frame, without derived quantities."""
        return self.wire("full", lambda: self._full(self._writer.plain_json))

    def first(self) -> bytes:
        """The same with derived quantities, for a client that gets deltas from then on."""
        return self.wire("first", lambda: self._full(self._writer.json))

    def delta(self) -> bytes:
        """`schema.DeltaFrame` as a WebSocket frame: only what differs from `base`."""
        return self.wire("delta", self._delta)

    def wire(self, kind: str, payload: Callable[[], bytes]) -> bytes:
        """The frame of this kind, from `payload()` if it is the first call."""
        wire = self._wires.get(kind)
        if wire is None:
            wire = self._wires[kind] = text_frame(payload())
        return wire

    def _full(self, json: StateJson) -> bytes:
        return b'{"type":"state","seq":%d,"revision":%b,"state":%b,"health":%b}' % (
            self.seq,
            orjson.dumps(self.revision),
            json.state(self.snapshot, self.snapshot.now_ns),
            judgement(self.judged),
        )

    def _delta(self) -> bytes:
        assert self.base is not None  # the hub calls this only with a base
        changed, removed = difference(self.base.snapshot.tags, self.snapshot.tags)
        stamp_ns = self.snapshot.stamp_ns
        return (
            b'{"type":"delta","seq":%d,"base":%d,"revision":%b,"header":%b,'
            b'"changed":[%b],"removed":%b,"health":%b}'
        ) % (
            self.seq,
            self.base.seq,
            orjson.dumps(self.revision),
            orjson.dumps(header(stamp_ns, self.snapshot.frame_id)),
            b",".join([self._writer.json.tag(tag, self.snapshot.now_ns) for tag in changed]),
            orjson.dumps(removed),
            judgement_since(self.base.judged, self.judged),
        )


def difference(
    before: Sequence[TagState], after: Sequence[TagState]
) -> tuple[list[TagState], list[str]]:
    """The tags of `after` that are not the same objects in `before`, and the removed tag_ids.

    A running twin keeps the order of its tags, and appends new ones. So they are compared by
    position: 0.3 ms for 10,000 tags. Only after a restart are they looked up by tag_id.
    """
    pairs = [(old, new) for old, new in zip(before, after, strict=False) if old is not new]
    if len(after) >= len(before) and all(old.tag_id == new.tag_id for old, new in pairs):
        return [*(new for _, new in pairs), *after[len(before) :]], []
    left = {tag.tag_id: tag for tag in before}
    changed = [tag for tag in after if left.pop(tag.tag_id, None) is not tag]
    return changed, list(left)


class FrameWriter:
    """Makes and numbers the frames; `seq` starts at 1 and grows by one per frame.

    `derived` names the derived quantities to write.
    """

    def __init__(self, derived: Collection[str] = ()) -> None:
        self.json = StateJson(derived)
        self.plain_json = StateJson()
        self.message_json = StateJson(has_times=False)
        self._newest: StateFrame | None = None

    def state(
        self, snapshot: Snapshot, revision: str, judged: Judged = NOTHING_JUDGED
    ) -> StateFrame:
        """The next state frame, with the judgement of that state."""
        base = self._newest
        if base is not None:
            base.let_go()
        frame = StateFrame(
            seq=1 if base is None else base.seq + 1,
            revision=revision,
            snapshot=snapshot,
            judged=judged,
            base=base,
            _writer=self,
        )
        self._newest = frame
        for json in (self.json, self.plain_json, self.message_json):
            json.keep_only(snapshot)
        return frame
