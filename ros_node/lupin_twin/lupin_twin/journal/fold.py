"""Computes the state from the journal: what is known about every tag in a run up to a moment.

A query about the past, the start of a twin, and the copies at a run's beginning all use this fold.
The latest row of each series up to then counts; of equal stamps, the one received later.
"""

from __future__ import annotations

import gc
import math
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from itertools import repeat
from typing import Any, Final

from lupin_twin.core.drops import MAX_SENSORS_PER_TAG, MAX_TAGS
from lupin_twin.core.past import FOREVER_NS
from lupin_twin.core.state import (
    NO_FLOWER,
    STATUS_OK,
    Attempt,
    Flower,
    Observation,
    Pin,
    Pose,
    Reading,
    Snapshot,
    TagState,
    Write,
)
from lupin_twin.journal import sql
from lupin_twin.journal.rows import flower_of, listed_rows, named_numbers
from lupin_twin.journal.runs import Run, runs, since_seq, span_at
from lupin_twin.journal.schema import LOCAL_SITE, SiteLog

# Approximate cost of a state, seconds of one core for each tag.
STATE_S_PER_TAG: Final = 1e-5


@dataclass(frozen=True, slots=True)
class Restored:
    """What a starting twin knows: its run, the state, and the last writes for the histories.

    `last_seq` is how many writes the journal has seen. `doubted_ns` is the latest wall time in the
    journal if the clock now contradicts it; then there is no run to write into yet.
    """

    run: Run
    known: FoldedState
    rows: tuple[Observation, ...]
    last_seq: int
    doubted_ns: int | None = None


@dataclass(frozen=True, slots=True)
class FoldedState:
    """Tags in the order in which they were first received, and the numbers of the rows used.

    `observed` are the tags with an observation: others have only failed attempts, or a pose.
    `placed_ns` is the time from which each tag has its pose.
    """

    tags: tuple[TagState, ...] = ()
    observed: frozenset[str] = frozenset()
    placed_ns: Mapping[str, int] = field(default_factory=dict)
    scans: tuple[int, ...] = ()
    inspections: tuple[int, ...] = ()


def state_at(connection: sqlite3.Connection, at_ns: int, frame_id: str) -> Snapshot:
    """Every tag as of `at_ns`, ROS time, in the order in which the journal first received them.

    All writes with a stamp up to then count, of the run that the moment belongs to, whenever they
    were received. If others write meanwhile, call it within a transaction.
    """
    every = runs(connection.execute)
    span = span_at(every, at_ns)
    if span is None:
        return Snapshot(at_ns, frame_id, ())
    since = since_seq(every, span.run, at_ns)
    known = fold(connection, span.run, at_ns, since)
    return Snapshot(at_ns, frame_id, known.tags[:MAX_TAGS])


def fold(connection: sqlite3.Connection, run: int, at_ns: int, since: int) -> FoldedState:
    """What is known in a run as of a moment, from rows numbered `since` or later."""
    with _no_collection():
        return _known(connection, {"site": LOCAL_SITE, "run": run, "at": at_ns, "since": since})


@contextmanager
def _no_collection() -> Iterator[None]:
    """Pause garbage collection, which would run a hundred times for 90,000 new, live values."""
    gc.disable()
    try:
        yield
    finally:
        gc.enable()  # a second thread that is inside only becomes slower


def _known(connection: sqlite3.Connection, query: dict[str, Any]) -> FoldedState:
    execute = connection.execute
    # By tag: the number of its first write, its last attempt, when it was observed, its readings.
    first: dict[str, int] = {}
    attempts: dict[str, tuple[int, int, int, str]] = {}
    observed: dict[str, int] = {}
    found: dict[str, list[tuple[int, int, tuple[Reading, ...]]]] = {}
    scans = sorted(execute(sql.STATE_SCANS, query).fetchall())
    bare = execute(sql.STATE_BARE_SCANS, query).fetchall()
    every = named_numbers((row[2] for row in scans), [row[7] for row in scans])
    for row, (names, values) in zip(scans, every, strict=True):
        series, tag, _, seq, stamp_ns, status, detail, _ = row
        attempt = stamp_ns, seq, status, detail
        if tag not in first:
            first[tag], attempts[tag] = series, attempt
        elif attempt > attempts[tag]:
            attempts[tag] = attempt
        if values:
            readings = tuple(map(Reading, names, values, repeat(stamp_ns)))
            found.setdefault(tag, []).append((stamp_ns, seq, readings))
            if stamp_ns > observed.get(tag, -1):
                observed[tag] = stamp_ns
    for _, tag, _, _, stamp_ns, *_ in bare:
        observed[tag] = max(stamp_ns, observed.get(tag, -1))
    flowers: dict[str, tuple[Flower, int]] = {}
    inspections = execute(sql.STATE_INSPECTIONS, query).fetchall()
    for series, tag, seq, stamp_ns, *flower in inspections:
        first[tag] = min(series, first.get(tag, series))
        attempt = stamp_ns, seq, STATUS_OK, ""
        attempts[tag] = max(attempt, attempts.get(tag, attempt))
        observed[tag] = max(stamp_ns, observed.get(tag, -1))
        flowers[tag] = flower_of(flower), stamp_ns
    poses, placed_ns = _places(execute, query, first)
    states = []
    for tag in sorted(first, key=first.__getitem__):
        last, observed_ns = attempts.get(tag), observed.get(tag)
        if last is not None and observed_ns is None:
            (observed_ns,) = execute(sql.FIRST_FAILURE, query | {"tag": tag}).fetchone()
        flower, inspected_ns = flowers.get(tag, (NO_FLOWER, None))
        states.append(
            TagState(
                tag,
                poses.get(tag),
                _latest(found.get(tag, ())),
                observed_ns,
                flower,
                inspected_ns,
                last and Attempt(last[0], last[2], last[3]),
            )
        )
    return FoldedState(
        tuple(states),
        frozenset(observed),
        placed_ns,
        tuple(dict.fromkeys(row[3] for row in (*scans, *bare))),
        tuple(row[2] for row in inspections),
    )


def _places(
    execute: Any, query: dict[str, Any], first: dict[str, int]
) -> tuple[dict[str, Pose], dict[str, int]]:
    """The pose of each tag, from its first finite one, and the time from which it has that."""
    poses: dict[str, Pose] = {}
    placed_ns: dict[str, int] = {}
    numbers: dict[str, int] = {}
    for seq, tag, stamp_ns, _, _, *pose in execute(sql.PLACES, query).fetchall():
        if not math.isfinite(sum(pose)):  # damage, or a site's own write: it would break each field
            continue
        if tag not in poses:
            poses[tag], placed_ns[tag], numbers[tag] = Pose(*pose), stamp_ns, seq
        elif stamp_ns < placed_ns[tag]:
            placed_ns[tag] = stamp_ns
    for tag, seq in numbers.items():
        if placed_ns[tag] > query["at"]:
            del poses[tag]
        elif seq < first.get(tag, FOREVER_NS):
            first[tag] = seq
    return poses, placed_ns


def _latest(scans: Sequence[tuple[int, int, tuple[Reading, ...]]]) -> tuple[Reading, ...]:
    """The latest reading of each sensor, in the order in which sensors were first received."""
    if len(scans) == 1:
        return scans[0][2]
    latest: dict[str, tuple[int, int, Reading]] = {}
    for stamp_ns, seq, readings in scans:
        for reading in readings:
            entry = latest.get(reading.name)
            if entry is None or (stamp_ns, seq) >= entry[:2]:
                latest[reading.name] = (stamp_ns, seq, reading)
    return tuple(reading for *_, reading in latest.values())[:MAX_SENSORS_PER_TAG]


def copies(connection: sqlite3.Connection, run: Run, *, places_only: bool) -> list[Write]:
    """Return what is known in a run, as rows for another run, or a step, that begins now.

    They are the rows that the fold uses, with the stamps that they have there. They are ordered by
    tag, then by stamp. `places_only`: tags do not move, but the age of their readings is unknown.
    """
    known = fold(connection, run.root, FOREVER_NS, run.begun_seq)
    found: dict[str, list[Observation]] = {tag.tag_id: [] for tag in known.tags}
    if not places_only:
        for row in listed_rows(SiteLog(connection), run.root, known.scans, known.inspections):
            found[row.tag_id].append(row)
    rows: list[Write] = []
    for tag in known.tags:
        placed_ns = known.placed_ns.get(tag.tag_id)
        if tag.pose is not None and placed_ns is not None:
            rows.append(Pin(tag.tag_id, tag.pose, placed_ns, run.begun.arrival_ns))
        mine = sorted(found[tag.tag_id], key=lambda row: row.stamp_ns)
        if mine and tag.tag_id not in known.observed:
            # The time since which nothing has been observed there.
            since_ns = tag.last_observed_ns or 0
            rows.append(replace(mine[0], stamp_ns=since_ns, own_stamp_ns=since_ns))
        rows += mine
    return rows
