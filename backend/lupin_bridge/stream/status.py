"""Whether the twin behind the bridge is alive, as one value that everything else tells.

Pure: the time is an argument, seconds of a clock that never jumps.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

from lupin_bridge.stream.state_json import stamp
from lupin_twin.core.diagnostics import Origin
from lupin_twin.core.drops import Recent
from lupin_twin.core.journal_condition import UNKNOWN, Condition, JournalState
from lupin_twin.core.state import ClockState

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
    "clock_doubted": "The twin's clock contradicts its journal. Ages are not known. Set the clock; "
    "after ten minutes it is believed as it is.",
    "never_seen": "No twin has been heard yet. Start it, or check ROS_DOMAIN_ID.",
    "stale": "The twin has fallen silent. Check that its process runs and is reachable.",
    "thread_dead": "The bridge's ROS thread has ended. Restart the bridge.",
    "shutting_down": "The bridge is shutting down.",
}


@dataclass(frozen=True, slots=True)
class Outward:
    """How a channel does that tells others by itself; `detail` is what is wrong, in a line."""

    channel: str
    is_failing: bool
    detail: str


@dataclass(frozen=True, slots=True)
class Status:
    """`reason` says why the twin counts as live or offline; `state_age_s` is None: never.

    `twin_count` is how many nodes publish the state topic; more than one is a mistake. `has_map`
    spares a browser requests whose 404 it would show as an error. `origin` is where what the twin
    observed comes from, as far as it says; `input_problems` is why it does not hear all.
    `day_length_s` is how long its day takes, s of ROS time: a demo's is shorter.
    """

    reason: Reason
    state_age_s: float | None
    twin_count: int = 1
    has_map: bool = False
    drops: tuple[Recent, ...] = ()
    journal: Condition = UNKNOWN
    outward: tuple[Outward, ...] = ()
    origin: Origin = "unknown"
    input_problems: tuple[str, ...] = ()
    day_length_s: float = 86_400.0

    @property
    def is_live(self) -> bool:
        """Whether what the bridge serves is current."""
        return self.reason in ("live", "paused")

    @property
    def message(self) -> str:
        """What to tell a person."""
        if self.is_live and self.twin_count > 1:
            return (
                f"{self.twin_count} twins publish on the same topic, and what you see is a mixture "
                "of them. Stop all but one, or give them ROS domains of their own."
            )
        return _MESSAGES[self.reason]

    def is_news_after(self, before: Status | None) -> bool:
        """Whether clients have to be told, who were told `before`."""
        return (
            before is None
            or self.has_more_detail_than(before)
            or before.has_map is not self.has_map
            or _about(before.drops) != _about(self.drops)
            or _news_of(before.journal) != _news_of(self.journal)
            or before.outward != self.outward
            or before.origin != self.origin
            or before.input_problems != self.input_problems
        )

    def has_more_detail_than(self, before: Status) -> bool:
        """Whether a person has to be told, who was told `before`."""
        return (before.reason, before.message) != (self.reason, self.message)

    def frame(self) -> dict[str, Any]:
        """`schema.StatusFrame`."""
        return {
            "type": "status",
            "twin": "live" if self.is_live else "offline",
            "reason": self.reason,
            "message": self.message,
            "state_age_seconds": None if self.state_age_s is None else round(self.state_age_s, 3),
            "has_map": self.has_map,
            "origin": self.origin,
            "twin_count": self.twin_count,
            "input_problems": list(self.input_problems),
            "day_length_s": self.day_length_s,
            "drops": [
                {"reason": drop.reason, "message": drop.message, "count": drop.count}
                for drop in self.drops
            ],
            "journal": _journal(self.journal),
            "outward": [
                {"channel": it.channel, "is_failing": it.is_failing, "detail": it.detail}
                for it in self.outward
            ],
        }


def _about(drops: tuple[Recent, ...]) -> dict[str, int]:
    """How often each, roughly: a stream of drops is no stream of statuses."""
    return {drop.reason: drop.count.bit_length() for drop in drops}


def _news_of(journal: Condition) -> tuple[object, ...]:
    """What is told of a journal at once: how far behind it is changes all the time."""
    detail = "" if journal.state == JournalState.SLOW else journal.detail
    return journal.state, detail, journal.set_aside, journal.simulated_ns


def _journal(journal: Condition) -> dict[str, Any]:
    simulated = journal.simulated_ns
    return {
        "state": journal.state.value,
        "detail": journal.detail,
        "set_aside": journal.set_aside,
        "simulated": simulated and {"start": stamp(simulated[0]), "end": stamp(simulated[1])},
    }


@dataclass(slots=True)
class Liveness:
    """When the twin's last state came and what it said, and whether the thread still runs.

    `silent_s` is for how long the twin had been silent when that came: what an archive tells. Of
    `known` reason and age are those of then.
    """

    stale_after_s: float = STALE_AFTER_S
    last_state_s: float | None = None
    silent_s: float = 0.0
    clock: ClockState = "running"
    known: Status = Status("never_seen", None)
    thread_dead: bool = False
    shutting_down: bool = False

    def status(self, now_s: float) -> Status:
        """The status at `now_s`."""
        age = None
        if self.last_state_s is not None:
            age = max(0.0, now_s - self.last_state_s) + self.silent_s
        return replace(self.known, reason=self._reason(age), state_age_s=age)

    def _reason(self, age_s: float | None) -> Reason:
        if self.shutting_down:
            return "shutting_down"
        if self.thread_dead:
            return "thread_dead"
        if age_s is None:
            return "never_seen"
        return _OF_CLOCK[self.clock] if age_s < self.stale_after_s else "stale"
