"""A twin's report on `/diagnostics`: clock, inputs, drops, losses and journal. Pure.

`findings` makes the report, and `self_report` reads it in a consumer. Times are seconds.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType
from typing import Final, Literal, get_args

from lupin_twin.core.drops import Counts, Reason, Recent, cut
from lupin_twin.core.state import ClockState

# Longer texts are cut: a source's name, for example, may have any length.
MAX_SHOWN: Final = 500

# Key of the twin's state topic, by which a consumer recognises its twin. The node's name would not
# do: DDS sends it only once, and not again after a gap in the link longer than its lease.
STATE_TOPIC: Final = "state topic"

_REASONS: Final = tuple(reason.value for reason in Reason)
_RECENTLY: Final = "recently: "
_LAST: Final = "last: "
_ERRORS: Final = "callback errors"
_MAX_COUNT: Final = 10**15
_PROBLEM: Final = "problem "
# At most this many input problems are reported: a broken network may have any number.
MAX_PROBLEMS: Final = 8

# diagnostic_msgs/DiagnosticStatus
OK: Final = 0
WARN: Final = 1
ERROR: Final = 2
STALE: Final = 3

CLOCK: Final[Mapping[ClockState, tuple[int, str]]] = {
    "running": (OK, "ROS time runs"),
    "paused": (WARN, "ROS time is paused: /clock is published, but does not advance"),
    "stopped": (ERROR, "ROS time has stopped, nothing arrives on /clock: ages are not known"),
    "none": (ERROR, "there is no ROS time, nothing arrives on /clock: ages are not known"),
    "doubted": (ERROR, "ROS time contradicts the journal: ages are not known; set the clock"),
}


# Where observations come from, as the twin reports it. sim_time: the twin follows `/clock`, so they
# come from a simulation or from a recording that is played.
Origin = Literal["unknown", "robot", "simulated", "recorded", "sim_time"]
_ORIGIN: Final[Mapping[Origin, str]] = {
    "unknown": "the origin of observations is not known",
    "robot": "observations come from a robot",
    "simulated": "observations are simulated",
    "recorded": "observations are played from a recording",
    "sim_time": "time comes from /clock: from a simulation, or a recording",
}


def origin_of(name: str, *, is_simulated: bool) -> Origin:
    """The origin of that name; with a simulated clock, `robot` becomes `sim_time`."""
    origin: Origin = next((one for one in get_args(Origin) if one == name), "unknown")
    return "sim_time" if is_simulated and origin == "robot" else origin


class JournalState(StrEnum):
    """State of the journal. Only `recording` means that everything is stored as promised."""

    UNKNOWN = "unknown"  # the twin runs elsewhere, and does not report it
    OFF = "off"  # recorded into a temporary file, which is deleted at the end
    STARTING = "starting"
    UPGRADING = "upgrading"  # the file has an older version; nothing is known before it is upgraded
    RECORDING = "recording"
    SLOW = "slow"  # the disk does not keep up: waiting rows are not safe yet
    FAILING = "failing"  # nothing can be written; retried again and again
    DOUBTING = "doubting"  # the clock contradicts the journal: nothing is written until it agrees
    IN_USE = "in_use"  # another process writes this file
    FOREIGN = "foreign"  # the file belongs to another program, or has a newer version


@dataclass(frozen=True, slots=True)
class Condition:
    """The journal's state, a sentence about it, and counts since the twin started.

    `waiting` rows are queued but not written yet, the oldest of them for `behind_s`. `lost` rows
    were discarded because too many were waiting. `quarantined` names the last quarantined file.
    `simulated_ns` is the period of ROS time, start and end, that a simulation filled in and no
    robot observed; None if there is none.

    Everything received up to `complete_ns`, ROS time, is written; None if that is unknown.
    `kept_ns` are the periods of ROS time, in order, of which all rows still exist. The rest was
    deleted, or was not recorded. `journal_id` identifies the file. `inode` tells which file at
    `path` is being written; 0: none, or unknown.
    """

    state: JournalState
    detail: str = ""
    path: str = ""
    written: int = 0
    waiting: int = 0
    behind_s: float = 0.0
    lost: int = 0
    file_bytes: int = 0
    quarantined: str = ""
    simulated_ns: tuple[int, int] | None = None
    complete_ns: int | None = None
    kept_ns: tuple[tuple[int, int], ...] = ()
    journal_id: str = ""
    inode: int = 0

    @property
    def is_well(self) -> bool:
        """Whether nothing has to be reported."""
        return self.state in _WELL


_WELL = frozenset(
    {JournalState.UNKNOWN, JournalState.OFF, JournalState.STARTING, JournalState.RECORDING}
)
UNKNOWN_JOURNAL = Condition(
    JournalState.UNKNOWN, "the twin does not report whether it keeps a journal"
)


@dataclass(frozen=True, slots=True)
class Finding:
    """One diagnostic_msgs/DiagnosticStatus, its name without the node's."""

    name: str
    level: int
    message: str
    values: Mapping[str, str]


@dataclass(frozen=True, slots=True)
class Health:
    """What the report is made from. `inputs` is the number of publishers of each input topic.

    `input_problems` say why some of their messages are not received, with the remedy.
    `observed_ago_s` is how long ago the last observation was accepted; None if there was none.
    `late` is how many observations of each source were behind its own earlier ones. `others` are
    findings from other parts of the twin.
    """

    clock: ClockState
    counts: Counts
    inputs: Mapping[str, int]
    observed_ago_s: float | None
    late: Mapping[str, int]
    twins: int
    state_topic: str
    fields_computing: int
    fields_computed: int
    slowest_field_s: float
    journal: Condition = UNKNOWN_JOURNAL
    others: tuple[Finding, ...] = ()
    origin: Origin = "robot"
    input_problems: tuple[str, ...] = ()


def findings(health: Health) -> Iterator[Finding]:
    """Yield the findings of the report."""
    level, message = CLOCK[health.clock]
    yield Finding("clock", level, message, {"state": health.clock})
    yield Finding("origin", OK, _ORIGIN[health.origin], {"origin": health.origin})
    yield _inputs(health)
    counts = health.counts
    recent = counts.recent
    yield Finding(
        "drops",
        WARN if recent or counts.callback_errors else OK,
        "; ".join(f"{drop.count} recently: {shown(drop.message)}" for drop in recent)
        or "nothing recently",
        {
            **{str(why): str(count) for why, count in counts.dropped.items()},
            **{_RECENTLY + drop.reason: str(drop.count) for drop in recent},
            **{_LAST + drop.reason: shown(drop.message) for drop in recent},
            _ERRORS: str(counts.callback_errors),
        },
    )
    late = {shown(source): str(count) for source, count in health.late.items()}
    yield Finding(
        "stamps",
        WARN if late else OK,
        f"stamps behind their own earlier ones from {shown(', '.join(late))}"
        if late
        else "no late stamps",
        late,
    )
    yield Finding(
        "fields",
        OK,
        f"{health.fields_computing} being computed",
        {"computed": str(health.fields_computed), "slowest, s": f"{health.slowest_field_s:.3f}"},
    )
    yield from health.others
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
            "set aside": journal.quarantined,
            # Start and end of the simulated past. This and the next two are ns of ROS time.
            "simulated": _stretches((journal.simulated_ns,) if journal.simulated_ns else ()),
            "complete to": "" if journal.complete_ns is None else str(journal.complete_ns),
            "kept": _stretches(journal.kept_ns),
            "id": journal.journal_id,
        },
    )
    several = health.twins > 1
    yield Finding(
        "twins",
        ERROR if several else OK,
        f"{health.twins} twins publish on the same topic" if several else "no other twin",
        {"twins": str(health.twins), STATE_TOPIC: health.state_topic},
    )


def _inputs(health: Health) -> Finding:
    values = {topic: str(count) for topic, count in health.inputs.items()}
    observed_ago_s = health.observed_ago_s
    if observed_ago_s is not None:
        values["last observation, s ago"] = f"{observed_ago_s:.1f}"
    problems = [shown(problem) for problem in health.input_problems]
    values |= {f"{_PROBLEM}{number}": problem for number, problem in enumerate(problems, 1)}
    silent = [topic for topic, count in health.inputs.items() if not count]
    if problems:
        return Finding("inputs", WARN, "; ".join(problems), values)
    if observed_ago_s is None:
        return Finding("inputs", STALE, "no observation has been accepted yet", values)
    if silent:
        return Finding("inputs", WARN, f"nothing publishes {', '.join(silent)}", values)
    return Finding("inputs", OK, "all inputs have publishers", values)


def shown(text: str) -> str:
    """The text, cut to `MAX_SHOWN` characters."""
    return cut(text, MAX_SHOWN)


# --- reading the report ---------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class SelfReport:
    """A twin's own report: its clock, and what it dropped and lost; None if not reported.

    `origin` is where its observations come from. `journal` has only the counts that are published.
    `input_problems` say why the twin does not receive everything.
    """

    clock: ClockState | None = None
    counts: Counts | None = None
    journal: Condition = UNKNOWN_JOURNAL
    origin: Origin = "unknown"
    input_problems: tuple[str, ...] = ()


def self_report(reported: Iterable[Finding]) -> SelfReport:
    """Read the report made by `findings`, as far as possible; unknown reasons are left out."""
    by_name = {finding.name: finding for finding in reported}
    values = {name: finding.values for name, finding in by_name.items()}
    journal = _journal(by_name["journal"]) if "journal" in by_name else UNKNOWN_JOURNAL
    clock = next((state for state in CLOCK if state == values.get("clock", {}).get("state")), None)
    origin = origin_of(values.get("origin", {}).get("origin", ""), is_simulated=False)
    inputs = values.get("inputs", {})
    problems = tuple(
        shown(inputs[key])
        for number in range(1, MAX_PROBLEMS + 1)
        if (key := f"{_PROBLEM}{number}") in inputs
    )
    drops = values.get("drops", {})
    recent = tuple(
        Recent(reason, shown(drops.get(_LAST + reason, "")), count)
        for reason in _REASONS
        if (count := _number(drops, _RECENTLY + reason))
    )
    counts = Counts(
        MappingProxyType({why: count for why in _REASONS if (count := _number(drops, why))}),
        _number(drops, _ERRORS),
        recent,
    )
    return SelfReport(clock, counts if "drops" in values else None, journal, origin, problems)


def _journal(finding: Finding) -> Condition:
    values = finding.values
    state = next((state for state in JournalState if state == values.get("state")), None)
    if state is None:
        return UNKNOWN_JOURNAL
    simulated = _read_stretches(values.get("simulated", ""))
    complete = _numbers(values.get("complete to", ""))
    own = shown(values.get("id", ""))
    return Condition(
        state,
        shown(finding.message),
        path=shown(values.get("file", "")),
        written=_number(values, "written"),
        waiting=_number(values, "waiting"),
        lost=_number(values, "lost"),
        quarantined=shown(values.get("set aside", "")),
        simulated_ns=simulated[0] if len(simulated) == 1 else None,
        complete_ns=complete[0] if len(complete) == 1 else None,
        kept_ns=_read_stretches(values.get("kept", "")),
        # A copy's file is named by it, so it must not be a path.
        journal_id=own if own.isascii() and own.isalnum() else "",
    )


def _stretches(stretches: Iterable[tuple[int, int]]) -> str:
    return " ".join(str(stamp_ns) for stretch in stretches for stamp_ns in stretch)


def _numbers(text: str) -> list[int]:
    """Parse numbers or stamps of ROS time, ns; empty if the text is anything else."""
    words = text.split(" ") if len(text) <= MAX_SHOWN * 2 else []
    # No stamp has more digits. isascii(): isdigit() also accepts characters that int() refuses.
    are_numbers = all(word.isascii() and word.isdigit() and len(word) <= 19 for word in words)
    return [int(word) for word in words] if are_numbers else []


def _read_stretches(text: str) -> tuple[tuple[int, int], ...]:
    stamps = _numbers(text)
    return () if len(stamps) % 2 else tuple(zip(stamps[::2], stamps[1::2], strict=True))


def _number(values: Mapping[str, str], key: str) -> int:
    found = _numbers(values.get(key, ""))
    return found[0] if len(found) == 1 and found[0] < _MAX_COUNT else 0
