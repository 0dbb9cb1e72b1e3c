"""What the twin knew at a moment: the state that a replay of all writes up to then would leave."""

from __future__ import annotations

import sqlite3
from dataclasses import replace
from typing import Final

from lupin_twin.bounds import MAX_TAGS
from lupin_twin.journal.heard import Known, heard
from lupin_twin.journal.runs import Carries, Run
from lupin_twin.journal.spans import FOREVER_NS, MAX_RUNS, behind, span_at
from lupin_twin.state import Reading, Snapshot, TagState

# What a state takes, about, seconds of one core for each tag.
STATE_S_PER_TAG: Final = 6e-6


def state_at(connection: sqlite3.Connection, at_ns: int, frame_id: str) -> Snapshot:
    """Every tag as of `at_ns`, ROS time, in the order in which the journal first heard of them.

    Of the run that the moment belongs to, all writes with a stamp up to then count, whenever they
    were heard; and what that run carries from those before it. What is damaged is left out. Where
    others write meanwhile, ask within a transaction.
    """
    span = span_at(connection, at_ns)
    known = Known() if span is None else _known(connection, span.run, at_ns)
    return Snapshot(at_ns, frame_id, tuple(known.tags[:MAX_TAGS]))


def _known(connection: sqlite3.Connection, run: Run, at_ns: int) -> Known:
    chain = list(behind(connection, run))
    if at_ns < run.begun.stamp_ns:
        del chain[1:]  # what is carried is carried from the beginning on
    known = Known()
    for depth in range(len(chain) - 1, -1, -1):
        past, _, carries = chain[depth]
        own = heard(
            connection,
            past.id,
            FOREVER_NS if depth else at_ns,
            only_places=carries is not Carries.ALL or depth >= MAX_RUNS,
        )
        known = _after(known, own) if known.tags else own
        if depth:
            # Past so many, runs are left out between those of a chain.
            is_next = depth < MAX_RUNS
            begun_ns = chain[depth - 1][0].begun.stamp_ns if is_next else chain[depth][1]
            assert begun_ns is not None
            held = [tag.held_to(begun_ns) for tag in known.tags]
            known = Known(known.numbers, held, known.are_observed)
    return known


def _after(carried: Known, own: Known) -> Known:
    """What is known when the one was carried into the run that the other was heard in."""
    found = {
        number: (tag, is_observed)
        for number, tag, is_observed in zip(
            carried.numbers, carried.tags, carried.are_observed, strict=True
        )
    }
    for number, tag, is_observed in zip(own.numbers, own.tags, own.are_observed, strict=True):
        before = found.get(number)
        found[number] = (
            (tag, is_observed)
            if before is None
            else (_joined(before[0], tag, before[1], is_observed), before[1] or is_observed)
        )
    numbers = sorted(found)
    return Known(
        numbers,
        [found[number][0] for number in numbers],
        [found[number][1] for number in numbers],
    )


def _joined(before: TagState, tag: TagState, was_observed: bool, is_observed: bool) -> TagState:
    """A tag as the store would leave it; of equal stamps, what came later counts."""
    readings = {reading.name: reading for reading in before.readings}
    for reading in tag.readings:
        kept = readings.get(reading.name)
        if kept is None or _stamp(kept) <= _stamp(reading):
            readings[reading.name] = reading
    last_try = tag.last_try
    if last_try is None or (before.last_try and before.last_try.stamp_ns > last_try.stamp_ns):
        last_try = before.last_try
    saw = before if tag.looked_at_ns is None or _is_earlier(tag, before) else tag
    times = [t.last_observed_ns for t in (before, tag) if t.last_observed_ns is not None]
    last_ns: int | None
    if was_observed and is_observed:
        last_ns = max(times)
    elif was_observed or is_observed:
        last_ns = (before if was_observed else tag).last_observed_ns
    else:
        last_ns = min(times, default=None)
    return replace(
        tag,
        pose=before.pose or tag.pose,
        readings=tuple(readings.values()),
        last_observed_ns=last_ns,
        flower=saw.flower,
        looked_at_ns=saw.looked_at_ns,
        last_try=last_try,
    )


def _stamp(reading: Reading) -> int:
    return reading.observed_at_ns or 0


def _is_earlier(tag: TagState, other: TagState) -> bool:
    return (tag.looked_at_ns or 0) < (other.looked_at_ns or 0)
