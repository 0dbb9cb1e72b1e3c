"""Lives of a journal, for hypothesis: rows in any order, some late, some again; clocks go back."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from hypothesis import strategies as st

from lupin_twin.journal.retention import Limits, purge_step
from lupin_twin.journal.rows import Row, ScanRow
from lupin_twin.journal.runs import Clock
from lupin_twin.journal.schema import transaction
from tests.support.journal import NOW, SECOND, look, opened, pin, scan
from tests.support.past_reference import Reference

MINUTE = 60 * SECOND
BEGUN = NOW // (3600 * SECOND) * 3600 * SECOND
LATEST = 400  # minutes
TAGS = ("7", "8", "ü 9")

_stamps = st.builds(
    lambda minute, ns: BEGUN + minute * MINUTE + ns, st.integers(0, LATEST), st.integers(0, 3)
)
_values = st.one_of(
    st.floats(-1e6, 1e6), st.sampled_from([float("nan"), float("inf"), 21.5, 1e-7, 21.53])
)


def _scan(tag: str, at_ns: int, source: str, values: dict[str, float]) -> ScanRow:
    return scan(tag, at_ns, source=source, **values)


def _failure(tag: str, at_ns: int, status: int, kind: int) -> ScanRow:
    return replace(scan(tag, at_ns), readings=(), status=status, kind=kind, detail="no")


_tags = st.sampled_from(TAGS)
_rows: st.SearchStrategy[Row] = st.one_of(
    st.builds(
        _scan,
        _tags,
        _stamps,
        st.sampled_from(["robot", "other"]),
        st.dictionaries(st.sampled_from(["temperature", "co2"]), _values, min_size=1),
    ),
    st.builds(_failure, _tags, _stamps, st.integers(1, 3), st.integers(0, 1)),
    st.builds(
        lambda tag, at, anomaly: look(tag, at, anomaly=anomaly), _tags, _stamps, st.booleans()
    ),
    st.builds(pin, _tags, _stamps),
)
# Rows that come together, what was heard already, a clock that goes back, steps of folding.
steps = st.lists(
    st.one_of(
        st.tuples(st.just("rows"), st.lists(_rows, min_size=1, max_size=12)),
        st.tuples(st.just("again"), st.integers(0, 9)),
        st.tuples(st.just("back"), st.integers(0, LATEST)),
        st.tuples(st.just("upkeep"), st.integers(1, 9)),
    ),
    min_size=1,
    max_size=8,
)
periods = st.one_of(
    st.tuples(_stamps, _stamps).map(sorted),
    st.tuples(st.just(0), _stamps),
    st.tuples(_stamps, st.just(0)),
    st.just((0, 0)),
)


@contextmanager
def lived(path: Path, told: list[tuple[str, Any]]) -> Iterator[Reference]:
    """A journal that has lived through the steps."""
    with opened(path) as file:
        run = file.first_run(Clock(BEGUN, BEGUN, is_simulated=True))
        reference = Reference(file, run)
        for what, arg in told:
            match what:
                case "rows":
                    reference.write(arg)
                case "again":
                    reference.write(
                        [row for run, row in reference.rows if run == reference.run.id][-arg:]
                    )
                case "back":
                    begun_ns = BEGUN + arg * MINUTE
                    reference.go_back(begun_ns, begun_ns + 60 * MINUTE)
                case "upkeep":
                    upkeep(reference, arg)
        yield reference


def upkeep(reference: Reference, steps: int = 10**6) -> None:
    """Some steps of it, or all."""
    file = reference.file
    file._folded_s = file._tallied_s = 0.0
    while steps and (file._tally(99.0) or file._fold(0.0)):
        steps -= 1


def give_up(reference: Reference, before_ns: int) -> None:
    """Purge what arrived before, once it is counted."""
    upkeep(reference)
    connection = reference.file._connection
    with transaction(connection):
        while purge_step(connection, Limits(0.0, 10**12), before_ns):
            pass
