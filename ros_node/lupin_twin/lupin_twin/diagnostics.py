"""What a twin says of itself on `/diagnostics`: how it is, what it heard, lost and dropped. Pure.

Times are seconds.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from lupin_twin.counts import LOST, Counts
from lupin_twin.journal.condition import OFF as NO_JOURNAL
from lupin_twin.journal.condition import Condition
from lupin_twin.state import ClockState

# diagnostic_msgs/DiagnosticStatus
OK: Final = 0
WARN: Final = 1
ERROR: Final = 2
STALE: Final = 3

_CLOCK: Final[Mapping[ClockState, tuple[int, str]]] = {
    "running": (OK, "ROS time runs"),
    "paused": (WARN, "ROS time is paused"),
    "stopped": (ERROR, "ROS time has stopped: ages are not known"),
    "none": (ERROR, "there is no ROS time: ages are not known"),
}


@dataclass(frozen=True, slots=True)
class Health:
    """What is looked at. `inputs` is how many publish on each topic that is listened to.

    `observed_ago_s` is how long ago the last observation was taken in; None: none was. `late` is
    how many observations each source gave behind its own earlier ones.
    """

    clock: ClockState
    counts: Counts
    inputs: Mapping[str, int]
    observed_ago_s: float | None
    late: Mapping[str, int]
    twins: int
    fields_computing: int
    fields_computed: int
    slowest_field_s: float
    journal: Condition = NO_JOURNAL


@dataclass(frozen=True, slots=True)
class Finding:
    """One diagnostic_msgs/DiagnosticStatus, its name without the node's."""

    name: str
    level: int
    message: str
    values: Mapping[str, str]


def findings(health: Health) -> Iterator[Finding]:
    """All that is to be said, one by one."""
    level, message = _CLOCK[health.clock]
    yield Finding("clock", level, message, {"state": health.clock})
    yield _inputs(health)
    counts = health.counts
    recent = [drop for drop in counts.recent if drop.reason != LOST]
    yield Finding(
        "drops",
        WARN if recent or counts.callback_errors else OK,
        "; ".join(f"{drop.count} lately: {drop.message}" for drop in recent) or "nothing lately",
        {
            **{str(why): str(count) for why, count in counts.dropped.items() if why != LOST},
            **{f"lately: {drop.reason}": str(drop.count) for drop in recent},
            "callback errors": str(counts.callback_errors),
        },
    )
    lost = [drop for drop in counts.recent if drop.reason == LOST]
    yield Finding(
        "queues",
        WARN if lost else OK,
        f"{lost[0].count} messages lost lately" if lost else "nothing lost lately",
        {"lost": str(counts.dropped.get(LOST, 0))},
    )
    yield Finding(
        "stamps",
        WARN if health.late else OK,
        "stamps behind their own earlier ones" if health.late else "no stamps too late",
        {source: str(count) for source, count in health.late.items()},
    )
    yield Finding(
        "fields",
        OK,
        f"{health.fields_computing} being computed",
        {"computed": str(health.fields_computed), "slowest, s": f"{health.slowest_field_s:.3f}"},
    )
    journal = health.journal
    yield Finding(
        "journal",
        OK if journal.is_well else ERROR,
        journal.detail,
        {
            "state": journal.state.value,
            "file": journal.path,
            "written": str(journal.written),
            "waiting": str(journal.waiting),
            "lost": str(journal.lost),
            "refused": str(journal.refused),
            "set aside": journal.set_aside,
        },
    )
    several = health.twins > 1
    yield Finding(
        "twins",
        ERROR if several else OK,
        f"{health.twins} twins publish on the same topic" if several else "no other twin",
        {"twins": str(health.twins)},
    )


def _inputs(health: Health) -> Finding:
    values = {topic: str(count) for topic, count in health.inputs.items()}
    observed_ago_s = health.observed_ago_s
    if observed_ago_s is not None:
        values["last observation, s ago"] = f"{observed_ago_s:.1f}"
    silent = [topic for topic, count in health.inputs.items() if not count]
    if observed_ago_s is None:
        return Finding("inputs", STALE, "no observation has been taken in yet", values)
    if silent:
        return Finding("inputs", WARN, f"nobody publishes {', '.join(silent)}", values)
    return Finding("inputs", OK, "all inputs are there", values)
