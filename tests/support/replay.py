"""What a twin hears over several runs of its clock, and the plainest replay of it.

Stamps are small numbers, for moments to be equal, late and out of order often.
"""

from __future__ import annotations

from collections.abc import Container, Sequence
from dataclasses import dataclass, field, replace
from itertools import count

from hypothesis import strategies as st

from lupin_twin.journal.file import JournalFile
from lupin_twin.journal.rows import KIND_FLOWER, KIND_READING, LookRow, PinRow, Row, ScanRow
from lupin_twin.journal.runs import Carries, Clock, Run
from lupin_twin.state import Flower, Look, Pose, Reading, Scan, TwinStore


@dataclass(frozen=True)
class Hear:
    """A row, `late` ns old, after the clock has gone on; its stamp is filled in as it is heard."""

    row: Row
    advance: int
    late: int


@dataclass(frozen=True)
class Again:
    """The same row as one that was heard before, if there was one."""

    which: int


@dataclass(frozen=True)
class GoBack:
    """The clock goes back to a moment while the twin lives."""

    to: int


@dataclass(frozen=True)
class Restart:
    """Another twin on the same file, its clock further on (or back) by `passed`."""

    passed: int
    is_simulated: bool


Step = Hear | Again | GoBack | Restart
# What the small numbers of the steps count: more than a clock that is only set right goes back.
UNIT = 61_000_000_000

_SETS = ((), ("t",), ("t", "h"), ("h", "co2"), ("t", "t"))
_SMALL = st.integers(0, 3)
_TAGS = st.sampled_from(["1", "2"])
_VALUES = st.sampled_from([0.1, 1.0, 2.5, float("nan"), float("inf")])


@st.composite
def _rows(draw: st.DrawFn) -> Row:
    tag_id, source = draw(_TAGS), draw(st.sampled_from(["a", "b"]))
    match draw(st.sampled_from(["scan", "scan", "scan", "failed", "look", "blind", "pin"])):
        case "pin":
            return PinRow(tag_id, 0, 0, Pose(draw(_VALUES), 0.0, 0.0, 0.0, 0.0, 0.0, 1.0))
        case "look":
            flower = Flower(flower_count=draw(_SMALL), anomaly=draw(st.booleans()))
            return LookRow(tag_id, 0, 0, flower, source)
        case "blind":
            return ScanRow(tag_id, 0, 0, (), KIND_FLOWER, draw(st.integers(1, 2)), "dark", source)
        case kind:
            names = draw(st.sampled_from(_SETS))
            readings = tuple(Reading(name, draw(_VALUES)) for name in names)
            status = draw(st.integers(1, 2)) if kind == "failed" else 0
            detail = draw(st.sampled_from(["", "no"]))
            return ScanRow(tag_id, 0, 0, readings, KIND_READING, status, detail, source)


steps = st.lists(
    st.one_of(
        *[st.builds(Hear, _rows(), _SMALL, _SMALL)] * 5,
        st.builds(Again, st.integers(0, 9)),
        st.builds(GoBack, st.integers(15, 30)),
        st.builds(Restart, st.integers(-40, 40), st.booleans()),
    ),
    min_size=1,
    max_size=40,
)


@dataclass
class Life:
    """A run, all that was written in it with its number, in the order of hearing; its last moment.

    That is None while the run goes on.
    """

    run: Run
    ended_ns: int | None = None
    rows: list[tuple[int, Row]] = field(default_factory=list)


class Heard:
    """Writes steps into a file, and keeps the plainest account of them."""

    def __init__(self, file: JournalFile, steps: Sequence[Step]) -> None:
        self._file = file
        self._now = Clock(20 * UNIT, 1_000_000, is_simulated=False)
        self._numbers = count(1)
        self._written: set[object] = set()
        self._heard: list[Row] = []
        self.lives: dict[int, Life] = {}
        self._life = self._go_on_with(file.first_run(self._now))
        for step in steps:
            self._take(step)

    def _take(self, step: Step) -> None:
        match step:
            case GoBack(to) if to * UNIT < self._now.stamp_ns:
                self._life.ended_ns = self._now.stamp_ns
                self._pass(to * UNIT - self._now.stamp_ns)
                run = self._file.next_run(self._life.run, self._now, self._life.ended_ns)
                self._life = self._go_on_with(run)
            case Restart(passed, is_simulated):
                self._pass(passed * UNIT)
                self._now = replace(self._now, is_simulated=is_simulated)
                self._life = self._go_on_with(self._file.first_run(self._now))
            case Hear(row, advance, late):
                self._pass(advance * UNIT)
                now_ns = self._now.stamp_ns
                stamp_ns = now_ns if isinstance(row, PinRow) else max(1, now_ns - late * UNIT)
                self._hear(replace(row, stamp_ns=stamp_ns, arrival_ns=self._now.arrival_ns))
            case Again(which) if self._heard:
                row = self._heard[which % len(self._heard)]
                if row.stamp_ns <= self._now.stamp_ns:
                    self._hear(replace(row, arrival_ns=self._now.arrival_ns))

    def _pass(self, passed_ns: int) -> None:
        now = self._now
        self._now = replace(
            now, stamp_ns=max(1, now.stamp_ns + passed_ns), arrival_ns=now.arrival_ns + 1000
        )

    def _go_on_with(self, run: Run) -> Life:
        for life in self.lives.values():
            if life.ended_ns is None:
                stamps = [row.stamp_ns for _, row in life.rows]
                life.ended_ns = max([life.run.begun.stamp_ns, *stamps])
        life = self.lives.setdefault(run.id, Life(run))
        life.ended_ns = None
        return life

    def _hear(self, row: Row) -> None:
        self._heard.append(row)
        key = (self._life.run.id, _known_by(row))
        if key not in self._written:
            self._written.add(key)
            self._life.rows.append((next(self._numbers), row))
        self._file.append([(self._life.run, row)])

    @property
    def tag_ids(self) -> list[str]:
        """All tags, in the order in which they were first heard of."""
        rows = sorted((entry for life in self.lives.values() for entry in life.rows), key=_number)
        return list(dict.fromkeys(row.tag_id for _, row in rows))

    # --- the plain replay ---------------------------------------------------------------------

    @property
    def moments(self) -> list[int]:
        """Every moment at which anything was, and those right beside it."""
        at = {row.stamp_ns for life in self.lives.values() for _, row in life.rows}
        at |= {life.run.begun.stamp_ns for life in self.lives.values()}
        at |= {life.ended_ns for life in self.lives.values() if life.ended_ns is not None}
        return sorted({max(0, ns + near) for ns in at for near in (-1, 0, 1)})

    def holder(self, at_ns: int) -> Life:
        """The newest run that holds a moment, else the one that did before, else the first."""
        lives = self.lives.values()
        holding = [
            life
            for life in lives
            if life.run.begun.stamp_ns <= at_ns
            and (life.ended_ns is None or at_ns <= life.ended_ns)
        ]
        if holding:
            return max(holding, key=lambda life: life.run.id)
        ended = [life.ended_ns for life in lives if life.ended_ns is not None]
        before = [ended_ns for ended_ns in ended if ended_ns < at_ns]
        first_ns = min(life.run.begun.stamp_ns for life in lives)
        return self.holder(max(before) if before else first_ns)

    def store_at(self, at_ns: int, damaged: Container[int] = ()) -> TwinStore:
        """What a twin knows that heard all that was written up to a moment and is not damaged."""
        life = self.holder(at_ns)
        is_begun = life.run.begun.stamp_ns <= at_ns
        store = self._carried(life.run, damaged) if is_begun else TwinStore()
        for number, row in life.rows:
            if row.stamp_ns <= at_ns and number not in damaged:
                write(row, store)
        return store

    def _carried(self, run: Run, damaged: Container[int]) -> TwinStore:
        store = TwinStore()
        if run.carries is Carries.NOTHING or run.follows is None:
            return store
        known = self._carried(self.lives[run.follows].run, damaged)
        for number, row in self.lives[run.follows].rows:
            if number not in damaged:
                write(row, known)
        if run.carries is Carries.ALL:
            known.hold_to(run.begun.stamp_ns)
            return known
        for tag in known.snapshot(0, "").tags:
            if tag.pose is not None:
                store.pin(tag.tag_id, tag.pose)
        return store


def _number(entry: tuple[int, Row]) -> int:
    return entry[0]


def _known_by(row: Row) -> object:
    if isinstance(row, PinRow):
        return row.tag_id
    sensors = tuple(r.name for r in row.readings) if isinstance(row, ScanRow) else None
    kind = (row.kind, row.status) if isinstance(row, ScanRow) else None
    return row.tag_id, row.source, kind, sensors, row.stamp_ns


def write(row: Row, store: TwinStore) -> None:
    """Give a store what a row was written for."""
    match row:
        case PinRow():
            store.pin(row.tag_id, row.pose)
        case LookRow():
            store.record_look(Look(row.tag_id, row.stamp_ns, row.flower))
        case ScanRow(kind=0):
            readings = row.readings
            store.record(Scan(row.tag_id, row.stamp_ns, readings, None, row.status, row.detail))
        case ScanRow():
            store.record_look(Look(row.tag_id, row.stamp_ns, None, None, row.status, row.detail))
