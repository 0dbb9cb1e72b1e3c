"""What was heard in one run of the clock up to a moment: the latest of everything, for each tag."""

from __future__ import annotations

import gc
import sqlite3
import threading
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import chain, repeat
from typing import Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from lupin_twin.bounds import MAX_SENSORS_PER_TAG
from lupin_twin.journal.columns import Ints, distinct, unpacked
from lupin_twin.journal.fixed import Places, places_of, tag_ids_of
from lupin_twin.journal.flowers import unpack_flowers
from lupin_twin.journal.newest import Looks, Scans, looks_of
from lupin_twin.journal.packing import Damaged
from lupin_twin.journal.reading import Names
from lupin_twin.journal.rows import KIND_READING, STATUS_OK
from lupin_twin.making import make_many
from lupin_twin.state import NO_FLOWER, Pose, Reading, TagState, Try

_NEVER: Final = -1
_FOREVER: Final = 2**63 - 1

ValueT = TypeVar("ValueT")


@dataclass(frozen=True, slots=True)
class Known:
    """Tags in the order of their numbers, and whether anything was observed at each."""

    numbers: Sequence[int] = ()
    tags: Sequence[TagState] = ()
    are_observed: Sequence[bool] = ()


def heard(
    connection: sqlite3.Connection, run: int, until_ns: int, *, only_places: bool = False
) -> Known:
    """What the writes of a run with a stamp up to `until_ns` leave, in the order of the tags.

    What is damaged counts as never written.
    """
    places = places_of(connection, run, until_ns)
    scans = looks = None
    numbers = [places.tags]
    if not only_places:
        scans = Scans.of(connection, run, until_ns, "DESC")
        looks = looks_of(connection, run, until_ns)
        numbers += [scans.tag, looks.tag]
    tags = distinct(np.concatenate(numbers))
    made, tag_ids = _Tags(tags), tag_ids_of(connection, tags)
    with _NO_SEARCH:
        made.pin(places)
        if scans is not None and looks is not None:
            made.read(scans)
            made.look(looks, Names(connection))
            made.try_all(scans, looks)
    if scans is not None and not made.is_observed.all():
        made.fail(Scans.of(connection, run, until_ns, "ASC"))
    with _NO_SEARCH:
        return made.known(tag_ids)


class _NoSearch:
    """Python looks for no garbage meanwhile: a hundred times in 90,000 new values, all alive."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._inside = 0
        self._was_enabled = True

    def __enter__(self) -> None:
        with self._lock:
            if not self._inside:
                self._was_enabled = gc.isenabled()
                gc.disable()
            self._inside += 1

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._inside -= 1
            if not self._inside and self._was_enabled:
                gc.enable()


_NO_SEARCH: Final = _NoSearch()


# --- putting together -----------------------------------------------------------------------------


class _Tags:
    """The parts of tags, a place for each in the order of their numbers."""

    def __init__(self, tags: Ints) -> None:
        self._tags = tags
        count = len(tags)
        self._poses: list[Pose | None] = [None] * count
        self._readings: list[tuple[Reading, ...]] = [()] * count
        self._flowers = [NO_FLOWER] * count
        self._looked_at: list[int | None] = [None] * count
        self._tries: list[Try | None] = [None] * count
        self._observed = np.full(count, _NEVER, dtype=np.int64)
        self._failed = np.full(count, _FOREVER, dtype=np.int64)

    @property
    def is_observed(self) -> NDArray[np.bool_]:
        """At which of them anything was observed."""
        return self._observed > _NEVER

    def known(self, tag_ids: Sequence[str]) -> Known:
        """The tags, and those at which anything was observed."""
        is_observed = self.is_observed
        last = np.where(is_observed, self._observed, self._failed)
        last_observed: list[int | None] = last.tolist()
        for place in np.flatnonzero(last == _FOREVER).tolist():
            last_observed[place] = None
        tags = make_many(
            TagState,
            len(tag_ids),
            tag_ids,
            self._poses,
            self._readings,
            last_observed,
            self._flowers,
            self._looked_at,
            self._tries,
        )
        numbers, are_observed = self._tags.tolist(), is_observed.tolist()
        if "" in tag_ids:
            there = [place for place, tag_id in enumerate(tag_ids) if tag_id]
            numbers, tags, are_observed = (
                [column[place] for place in there] for column in (numbers, tags, are_observed)
            )
        return Known(numbers, tags, are_observed)

    def pin(self, places: Places) -> None:
        """Give tags their places."""
        _put(self._poses, self._places_of(places.tags), places.poses)

    def read(self, scans: Scans) -> None:
        """Take the readings of scans; several of one tag are merged."""
        brought = scans.brought
        np.maximum.at(self._observed, self._places_of(scans.tag[brought]), scans.stamp[brought])
        with_readings = (scans.kind == KIND_READING) & (scans.sensors > 0)
        readings: list[tuple[Reading, ...]] = [()] * len(scans.tag)
        for rows, sealed in scans.readings.by_length():
            for number in distinct(scans.set[rows]).tolist():
                of_set = (scans.set[rows] == number) & with_readings[rows]
                names = scans.sets[number] if of_set.any() else ()
                if names:
                    made = _readings(sealed[of_set], names, scans.stamp[rows[of_set]])
                    _put(readings, rows[of_set], made)
        rows = np.flatnonzero(with_readings)
        tags = self._places_of(scans.tag[rows])
        _put(self._readings, tags, [readings[row] for row in rows.tolist()])
        several = np.flatnonzero(np.bincount(tags, minlength=len(self._tags)) > 1)
        if len(several):
            self._merge(scans, rows[np.isin(tags, several)], readings)

    def _merge(self, scans: Scans, rows: Ints, readings: Sequence[tuple[Reading, ...]]) -> None:
        """The latest of each sensor of tags whose readings come in several series."""
        order = rows[np.lexsort((scans.series[rows], scans.tag[rows]))]
        of_tag: dict[int, list[int]] = {}
        for place, row in zip(
            self._places_of(scans.tag[order]).tolist(), order.tolist(), strict=True
        ):
            of_tag.setdefault(place, []).append(row)
        sets, ids = scans.set.tolist(), scans.id.tolist()
        are_disjoint: dict[tuple[int, ...], bool] = {}
        for place, mine in of_tag.items():
            key = tuple([sets[row] for row in mine])
            if key not in are_disjoint:
                names = [name for number in key for name in set(scans.sets[number])]
                are_disjoint[key] = len(names) == len(set(names))
            every: Iterable[Reading] = chain.from_iterable([readings[row] for row in mine])
            if not are_disjoint[key]:
                every = _latest([(ids[row], readings[row]) for row in mine])
            self._readings[place] = tuple(every)[:MAX_SENSORS_PER_TAG]

    def look(self, looks: Looks, names: Names) -> None:
        """Take the newest look at each tag's flowers."""
        newest = self._newest(looks.tag, looks.stamp, looks.id)
        tags = np.flatnonzero(newest >= 0)
        rows = newest[tags]
        self._observed[tags] = np.maximum(self._observed[tags], looks.stamp[rows])
        _put(self._looked_at, tags, looks.stamp[rows].tolist())
        told = np.stack(looks.told, axis=1)[rows].tolist()
        _put(
            self._flowers,
            tags,
            unpack_flowers(looks.shape.those(rows), told, partial(_name, names)),
        )

    def try_all(self, scans: Scans, looks: Looks) -> None:
        """Keep the last try of each tag, of whatever kind."""
        stamps = np.concatenate((scans.stamp, looks.stamp))
        statuses = np.concatenate((scans.status, np.full(len(looks.tag), STATUS_OK)))
        newest = self._newest(
            np.concatenate((scans.tag, looks.tag)), stamps, np.concatenate((scans.id, looks.id))
        )
        tags = np.flatnonzero(newest >= 0)
        rows = newest[tags]
        details = [""] * len(rows)
        are_told = np.flatnonzero(rows < len(scans.tag))
        are_told = are_told[scans.detail.lengths[rows[are_told]] > 0]
        texts = scans.detail.slices(rows[are_told])
        _put(details, are_told, [text.decode("utf-8", "replace") for text in texts])
        _put(
            self._tries,
            tags,
            make_many(Try, len(rows), stamps[rows].tolist(), statuses[rows].tolist(), details),
        )

    def fail(self, first: Scans) -> None:
        """A tag at which nothing was observed was tried first when it was."""
        np.minimum.at(self._failed, self._places_of(first.tag), first.stamp)

    def _newest(self, tags: Ints, stamps: Ints, numbers: Ints) -> Ints:
        """For each tag the row with the latest stamp, of equal ones the last written; -1: none."""
        newest = np.full(len(self._tags), -1, dtype=np.int64)
        order = np.lexsort((numbers, stamps))
        newest[self._places_of(tags[order])] = order
        return newest

    def _places_of(self, tags: Ints) -> Ints:
        return np.searchsorted(self._tags, tags)


def _readings(
    sealed: NDArray[np.uint8], names: tuple[str, ...], stamps: Ints
) -> Iterable[tuple[Reading, ...]]:
    numbers = unpacked(sealed, len(names))
    if numbers is None:
        return repeat((), len(sealed))
    last = {name: index for index, name in enumerate(names)}
    if len(last) < len(names):  # a name that comes twice has its last value
        numbers = numbers[:, list(last.values())]
    width = len(last)
    made = iter(
        make_many(
            Reading,
            numbers.size,
            chain.from_iterable(repeat(tuple(last), len(numbers))),
            numbers.ravel().tolist(),
            chain.from_iterable(zip(*[stamps.tolist()] * width, strict=True)),
        )
    )
    return zip(*[made] * width, strict=True)


def _latest(scans: Iterable[tuple[int, tuple[Reading, ...]]]) -> Iterable[Reading]:
    kept: dict[str, tuple[int, int, Reading]] = {}
    for number, readings in scans:
        for reading in readings:
            entry = (reading.observed_at_ns or 0, number, reading)
            if reading.name not in kept or kept[reading.name][:2] < entry[:2]:
                kept[reading.name] = entry
    return [reading for *_, reading in kept.values()]


def _name(names: Names, number: int) -> str:
    try:
        return names[number]
    except Damaged:
        return ""


def _put(into: list[ValueT], places: Ints, values: Iterable[ValueT]) -> None:
    for place, value in zip(places.tolist(), values, strict=True):
        into[place] = value
