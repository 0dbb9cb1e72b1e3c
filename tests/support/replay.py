"""What a twin hears over several runs of its clock, and the plainest replay of it.

Stamps are small numbers, for moments to be equal, late and out of order often.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TypeGuard

from hypothesis import strategies as st

from lupin_twin.core.history import KIND_FLOWER, kind_of
from lupin_twin.core.state import (
    Flower,
    Inspection,
    Pin,
    Pose,
    Reading,
    Scan,
    TagState,
    TwinStore,
    Write,
)
from lupin_twin.journal.file import JournalFile
from lupin_twin.journal.runs import CORRECTION_NS, Clock, Run


@dataclass(frozen=True)
class Hear:
    """A row, `late` ns old, after the clock has gone on; its stamp is filled in as it is heard."""

    row: Write
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
# What the small numbers of the steps count: four of them a wall clock may be set back, and no more.
UNIT = 61_000_000_000

_SETS = ((), ("t",), ("t", "h"), ("h", "co2"), ("t", "t"))
_SMALL = st.integers(0, 3)
_TAGS = st.sampled_from(["1", "2"])
# What is not finite is kept as such, and no pose is.
_VALUES = st.sampled_from([0.1, 1.0, 2.5, float("nan")])


@st.composite
def _rows(draw: st.DrawFn) -> Write:
    tag_id, source = draw(_TAGS), draw(st.sampled_from(["a", "b"]))
    match draw(st.sampled_from(["scan", "scan", "scan", "failed", "look", "blind", "pin"])):
        case "pin":
            return Pin(tag_id, Pose(float(draw(_SMALL)), 0.0, 0.0, 0.0, 0.0, 0.0, 1.0))
        case "look":
            flower = Flower(flower_count=draw(_SMALL), anomaly=draw(st.booleans()))
            return Inspection(tag_id, 0, flower, source=source)
        case "blind":
            return Inspection(tag_id, 0, None, None, draw(st.integers(1, 2)), "dark", source)
        case kind:
            names = draw(st.sampled_from(_SETS))
            readings = tuple(Reading(name, draw(_VALUES)) for name in names)
            status = draw(st.integers(1, 2)) if kind == "failed" else 0
            detail = draw(st.sampled_from(["", "no"]))
            return Scan(tag_id, 0, readings, None, status, detail, source)


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
class Stretch:
    """A run or a step, and the rows that hold in it, in the order in which they count.

    First come those that were known as it began, held to then.
    """

    run: Run
    rows: list[Write]


@dataclass
class Life:
    """A run with its steps, and its last moment; that is None while the run goes on."""

    stretches: list[Stretch]
    ended_ns: int | None = None
    known_by: dict[object, set[str]] = field(default_factory=dict)
    stamps: list[int] = field(default_factory=list)

    @property
    def run(self) -> Run:
        return self.stretches[0].run

    @property
    def begun_ns(self) -> int:
        """Its beginning; a step may lead to before that."""
        return min(stretch.run.begun.stamp_ns for stretch in self.stretches)


class Received:
    """Writes steps into a file, and keeps the plainest account of them."""

    def __init__(self, file: JournalFile, steps: Sequence[Step]) -> None:
        self._file = file
        self._now = Clock(20 * UNIT, 20 * UNIT, is_simulated=False)
        self._turns = 0
        self.lives: dict[int, Life] = {}
        self.tag_ids: dict[int, list[str]] = {}
        self._start()
        for step in steps:
            self._take(step)

    def _take(self, step: Step) -> None:
        match step:
            case GoBack(to) if to * UNIT < self._now.stamp_ns:
                self._go_back(to * UNIT)
            case Restart(passed, is_simulated):
                self._turns += 1
                self._pass(passed * UNIT + 1)
                self._now = replace(self._now, is_simulated=is_simulated)
                self._start()
            case Hear(row, advance, late):
                self._pass(advance * UNIT)
                now_ns = self._now.stamp_ns
                stamp_ns = now_ns if isinstance(row, Pin) else max(1, now_ns - late * UNIT)
                self._hear(replace(row, stamp_ns=stamp_ns, arrival_ns=self._now.arrival_ns))
            case Again(which):
                rows = [row for row in self._stretch.rows if row.arrival_ns == HEARD_NS]
                if rows and rows[which % len(rows)].stamp_ns <= self._now.stamp_ns:
                    self._hear(rows[which % len(rows)])

    def _pass(self, passed_ns: int) -> None:
        stamp_ns = max(1, self._now.stamp_ns + passed_ns)
        self._now = replace(self._now, stamp_ns=stamp_ns, arrival_ns=stamp_ns)

    def _go_back(self, to_ns: int) -> None:
        ended_ns = self._now.stamp_ns
        is_step = not self._now.is_simulated and ended_ns - to_ns <= CORRECTION_NS
        # No producer gives two observations one stamp, ns and all, in two runs of a wall clock.
        self._turns += 1
        self._pass(to_ns - ended_ns + (self._now.stamp_ns % UNIT if is_step else self._turns))
        before = self._stretch
        joins = before.run.root if is_step else None
        run = self._file.begin(self._now, before.run, joins=joins, ended_ns=ended_ns)
        if not is_step:
            self._life.ended_ns = ended_ns
        self._begin(run, before.rows, before.run.root)

    def _start(self) -> None:
        before = [life for life in self.lives.values() if self._is_like(life.run)]
        known = {s.run.id for life in self.lives.values() for s in life.stretches}
        run = self._file.start(self._now, is_believed=True).run
        if run.id not in known:
            last = max((s for life in before for s in life.stretches), key=_id, default=None)
            rows: list[Write] = []
            if last is not None and run.joins is not None:
                rows = last.rows
            elif last is not None and not run.begun.is_simulated:
                rows = [row for row in last.rows if isinstance(row, Pin)]
            self._begin(run, rows, run.root if last is None else last.run.root)
        else:
            self._go_on_with(self.lives[run.root])
            [self._stretch] = [s for s in self._life.stretches if s.run.id == run.id]

    def _is_like(self, run: Run) -> bool:
        return run.begun.is_simulated == self._now.is_simulated

    def _begin(self, run: Run, known: Sequence[Write], before: int) -> None:
        begun_ns = run.begun.stamp_ns
        in_order = sorted(known, key=lambda row: row.stamp_ns)
        held = [
            replace(row, stamp_ns=min(row.stamp_ns, begun_ns), arrival_ns=0) for row in in_order
        ]
        self._stretch = Stretch(run, held)
        life = self.lives.setdefault(run.root, Life([]))
        life.stretches.append(self._stretch)
        self._go_on_with(life)
        # In a run of their own they come in the order in which they were known before.
        tags = {row.tag_id for row in known}
        order = [tag_id for tag_id in self.tag_ids.get(before, []) if tag_id in tags]
        self.tag_ids.setdefault(run.root, order)

    def _go_on_with(self, life: Life) -> None:
        for other in self.lives.values():
            if other.ended_ns is None and other is not life:
                other.ended_ns = max([other.run.begun.stamp_ns, *other.stamps])
        life.ended_ns = None
        self._life = life

    def _hear(self, row: Write) -> None:
        if isinstance(row, Pin):
            first = next(
                (pin for s in self._life.stretches for pin in s.rows if _is_pin(pin, row)), row
            )
            row = replace(row, pose=first.pose)
        self._file.append([(self._stretch.run, row)])
        if row.tag_id not in self.tag_ids[self._life.run.id]:
            self.tag_ids[self._life.run.id].append(row.tag_id)
        kind = KIND_FLOWER if isinstance(row, Pin) else kind_of(row)
        key = (row.tag_id, kind, getattr(row, "source", ""), row.stamp_ns)
        if not isinstance(row, Pin) and key in self._life.known_by:
            known = self._life.known_by[key]
            if not isinstance(row, Scan):
                return
            row = replace(row, readings=tuple(r for r in row.readings if r.name not in known))
            if not row.readings:
                return
        names = {r.name for r in row.readings} if isinstance(row, Scan) else set()
        self._life.known_by.setdefault(key, set()).update(names)
        self._stretch.rows.append(replace(row, arrival_ns=HEARD_NS))
        if not isinstance(row, Pin):
            self._life.stamps.append(row.stamp_ns)

    # --- the plain replay ---------------------------------------------------------------------

    @property
    def moments(self) -> list[int]:
        """Every moment at which anything was, and those right beside it, from the first run on."""
        at = {r.stamp_ns for life in self.lives.values() for s in life.stretches for r in s.rows}
        begun = {s.run.begun.stamp_ns for life in self.lives.values() for s in life.stretches}
        at |= begun | {life.ended_ns for life in self.lives.values() if life.ended_ns is not None}
        return sorted({ns + near for ns in at for near in (-1, 0, 1) if ns + near >= min(begun)})

    def holder(self, at_ns: int) -> Life:
        """The newest run that holds a moment, else the one that did before, else the first."""
        lives = self.lives.values()
        holding = [
            life
            for life in lives
            if life.begun_ns <= at_ns
            and (life.ended_ns is None or at_ns <= max(life.ended_ns, life.run.begun.stamp_ns))
        ]
        if holding:
            return max(holding, key=lambda life: life.run.id)
        ended = [life.ended_ns for life in lives if life.ended_ns is not None]
        before = [ended_ns for ended_ns in ended if ended_ns < at_ns]
        if before:
            return self.holder(max(before))
        return min(lives, key=lambda life: (life.begun_ns, -life.run.id))

    def known_at(self, at_ns: int) -> list[TagState]:
        """What a twin knows that heard all that was written up to a moment, in order."""
        life = self.holder(at_ns)
        begun = [s for s in life.stretches if s.run.begun.stamp_ns <= at_ns]
        first = (begun or life.stretches[:1])[-1]
        # What is heard after a later step, and is of before it, counts by its stamp.
        later = life.stretches[life.stretches.index(first) + 1 :]
        rows = first.rows + [r for s in later for r in s.rows if r.arrival_ns == HEARD_NS]
        store = TwinStore()
        for row in rows:
            if row.stamp_ns <= at_ns:
                write(row, store)
        order = self.tag_ids[life.run.id]
        return sorted(store.snapshot(at_ns, "").tags, key=lambda tag: order.index(tag.tag_id))


# In the place of when it arrived: what was heard in a stretch, and not before it.
HEARD_NS = 1


def _id(stretch: Stretch) -> int:
    return stretch.run.id


def _is_pin(row: Write, of: Pin) -> TypeGuard[Pin]:
    return isinstance(row, Pin) and row.tag_id == of.tag_id


def write(row: Write, store: TwinStore) -> None:
    """Give a store what a row was written for."""
    match row:
        case Pin():
            store.pin(row.tag_id, row.pose)
        case Inspection():
            store.record_inspection(row)
        case Scan():
            store.record(row)
