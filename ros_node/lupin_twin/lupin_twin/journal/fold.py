"""From the log to the state: what is known of every tag in a run up to a moment.

The one fold: a question about the past, a start and the copies at a run's beginning go by it. Of
each series its newest row by then counts, of equal stamps the one received later.
"""

from __future__ import annotations

import gc
import sqlite3
import threading
from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from itertools import accumulate, chain, repeat
from typing import Any, Final, TypeVar

from lupin_twin.bounds import MAX_SENSORS_PER_TAG, MAX_TAGS
from lupin_twin.journal.reading import flower_of, listed_rows, numbers_of, sensor_names
from lupin_twin.journal.rows import KIND_READING, STATUS_OK, LookRow, PinRow, Row, ScanRow
from lupin_twin.journal.runs import FOREVER_NS, Carries, Run, runs, since_seq, span_at
from lupin_twin.journal.schema import LOCAL_SITE, DamagedFile
from lupin_twin.state import NO_FLOWER, Pose, Reading, Snapshot, TagState, Try

ValueT = TypeVar("ValueT")


def make_many(made: type[ValueT], count: int, *fields: Iterable[object]) -> list[ValueT]:
    """`count` values of a dataclass with slots; `fields` in its order, each so long at least."""
    values = list(map(object.__new__, repeat(made, count)))
    for name, column in zip(made.__slots__, fields, strict=True):  # type: ignore[attr-defined]
        deque(map(getattr(made, name).__set__, values, column), maxlen=0)
    return values


# What a state takes, about, seconds of one core for each tag.
STATE_S_PER_TAG: Final = 6e-6

_NEWEST: Final = (
    "(SELECT seq FROM scan WHERE site = s.site AND series = s.series AND stamp_ns <= :at"
    " AND seq >= :since {but}ORDER BY stamp_ns DESC, seq DESC LIMIT 1)"
)
_SCANS: Final = (
    "SELECT s.series, s.tag, s.kind, s.sensors, r.seq, r.stamp_ns, r.status, r.detail, r.readings"
    " FROM series AS s CROSS JOIN scan AS r ON r.site = s.site AND r.seq = {newest}"
    " WHERE s.site = :site AND s.run = :run {which}"
)
_LOOKS: Final = (
    "SELECT s.series, s.tag, r.seq, r.stamp_ns, r.species, r.confidence, r.anomaly,"
    " r.flower_count, r.bug_count, r.blooms, r.box"
    " FROM series AS s JOIN look AS r ON r.site = s.site"
    " AND r.seq = (SELECT seq FROM look WHERE site = s.site AND run = s.run AND tag = s.tag"
    " AND stamp_ns <= :at AND seq >= :since ORDER BY stamp_ns DESC, seq DESC LIMIT 1)"
    " WHERE s.site = :site AND s.run = :run AND s.kind = 1"
)
_FIRST_FAILURE: Final = (
    "SELECT min(stamp_ns) FROM series AS s JOIN scan AS r ON r.site = s.site"
    " AND r.series = s.series WHERE s.site = :site AND run = :run AND tag = :tag"
    " AND seq >= :since AND stamp_ns <= :at"
)
_PLACES: Final = (
    "SELECT seq, tag, stamp_ns, x, y, z, qx, qy, qz, qw FROM place"
    " WHERE site = :site AND run = :run ORDER BY seq"
)


@dataclass(frozen=True, slots=True)
class Restored:
    """What a twin that starts in a run knows: the state, and the last writes, for the histories.

    `last_seq` is how many writes the log has seen. `last_ns` is the latest moment of the wall's
    clock that the log knows; where the clock now contradicts that, `is_doubted`, and there is
    nothing yet to write to.
    """

    run: Run
    known: Known
    rows: tuple[ScanRow | LookRow, ...]
    last_seq: int
    last_ns: int = 0
    is_doubted: bool = False


@dataclass(frozen=True, slots=True)
class Known:
    """Tags in the order in which they were first heard of, and the numbers of what they rest on.

    `observed` are those at which anything was observed: others have only failed attempts, or a
    place. `placed_ns` is from when each tag has its place.
    """

    tags: tuple[TagState, ...] = ()
    observed: frozenset[str] = frozenset()
    placed_ns: Mapping[str, int] = field(default_factory=dict)
    scans: tuple[int, ...] = ()
    looks: tuple[int, ...] = ()


def state_at(
    connection: sqlite3.Connection, at_ns: int, frame_id: str, site: str = LOCAL_SITE
) -> Snapshot:
    """Every tag as of `at_ns`, ROS time, in the order in which the log first heard of them.

    Of the run that the moment belongs to, all writes with a stamp up to then count, whenever they
    were received. Where others write meanwhile, ask within a transaction.
    """
    every = runs(connection.execute, site)
    span = span_at(every, at_ns)
    if span is None:
        return Snapshot(at_ns, frame_id, ())
    since = since_seq(every, span.run.id, at_ns)
    known = fold(connection, span.run.id, at_ns, since, site)
    return Snapshot(at_ns, frame_id, known.tags[:MAX_TAGS])


def fold(
    connection: sqlite3.Connection, run: int, at_ns: int, since: int, site: str = LOCAL_SITE
) -> Known:
    """What is known in a run as of a moment, of what has the seq `since` or a later one."""
    gathering = _Gathering(connection, {"site": site, "run": run, "at": at_ns, "since": since})
    with _NO_SEARCH:
        scans = gathering.read_scans()
        looks = gathering.read_looks()
        placed_ns = gathering.read_places()
        return gathering.known(scans, looks, placed_ns)


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


class _Gathering:
    """Tags as they are read out of the three tables; `asked` is run, moment and first seq."""

    def __init__(self, connection: sqlite3.Connection, asked: dict[str, Any]) -> None:
        self._execute = connection.execute
        self._asked = asked
        self._tags: dict[str, _Tag] = {}

    def read_scans(self) -> tuple[int, ...]:
        newest = _SCANS.format(newest=_NEWEST.format(but=""), which="")
        rows = sorted(self._execute(newest, self._asked).fetchall())
        # Of series without sensors the newest may be a failure, and an attempt before it none.
        succeeded = _SCANS.format(
            newest=_NEWEST.format(but=f"AND status = {STATUS_OK} "),
            which=f"AND s.kind = {KIND_READING} AND s.sensors = '[]'",
        )
        rows += self._execute(succeeded, self._asked).fetchall()
        for row, readings in zip(rows, _readings(rows), strict=True):
            series, tag_id, kind, _, seq, stamp_ns, status, detail, _ = row
            tag = self._tags.get(tag_id)
            if tag is None:
                tag = self._tags[tag_id] = _Tag(series)
            tag.take(seq, stamp_ns, status, detail)
            if readings or (kind == KIND_READING and status == STATUS_OK):
                tag.read(seq, stamp_ns, readings)
        return tuple(dict.fromkeys(row[4] for row in rows))

    def read_looks(self) -> tuple[int, ...]:
        rows = self._execute(_LOOKS, self._asked).fetchall()
        for series, tag_id, seq, stamp_ns, *flower in rows:
            tag = self._tags.get(tag_id)
            if tag is None:
                tag = self._tags[tag_id] = _Tag(series)
            elif series < tag.first_seq:
                tag.first_seq = series
            tag.take(seq, stamp_ns, STATUS_OK, "")
            tag.read(seq, stamp_ns, ())
            tag.looked_ns, tag.flower = stamp_ns, flower_of(flower)
        return tuple(row[2] for row in rows)

    def read_places(self) -> dict[str, int]:
        """From when each tag has its place; the pose is that of the first write."""
        placed_ns: dict[str, int] = {}
        first: list[tuple[Any, ...]] = []
        for row in self._execute(_PLACES, self._asked).fetchall():
            _, tag_id, stamp_ns = row[:3]
            if tag_id not in placed_ns:
                placed_ns[tag_id] = stamp_ns
                first.append(row)
            elif stamp_ns < placed_ns[tag_id]:
                placed_ns[tag_id] = stamp_ns
        at_ns = self._asked["at"]
        first = [row for row in first if placed_ns[row[1]] <= at_ns]
        poses = make_many(Pose, len(first), *list(zip(*first, strict=True))[3:]) if first else []
        for row, pose in zip(first, poses, strict=True):
            tag = self._tags.get(row[1])
            if tag is None:
                tag = self._tags[row[1]] = _Tag(row[0])
            elif row[0] < tag.first_seq:
                tag.first_seq = row[0]
            tag.pose = pose
        return placed_ns

    def known(
        self, scans: tuple[int, ...], looks: tuple[int, ...], placed_ns: dict[str, int]
    ) -> Known:
        tags = sorted(self._tags.items(), key=lambda entry: entry[1].first_seq)
        for tag_id, tag in tags:
            if tag.observed_ns is None and tag.tried is not None:
                (tag.failed_ns,) = self._execute(
                    _FIRST_FAILURE, self._asked | {"tag": tag_id}
                ).fetchone()
        every = [tag for _, tag in tags]
        tried = [tag.tried for tag in every if tag.tried is not None]
        tries = iter(
            make_many(Try, len(tried), *list(zip(*tried, strict=True))[1:]) if tried else ()
        )
        states = make_many(
            TagState,
            len(tags),
            [tag_id for tag_id, _ in tags],
            [tag.pose for tag in every],
            [tag.scans[0][2] if len(tag.scans) == 1 else tag.latest() for tag in every],
            [tag.failed_ns if tag.observed_ns is None else tag.observed_ns for tag in every],
            [tag.flower for tag in every],
            [tag.looked_ns for tag in every],
            [None if tag.tried is None else next(tries) for tag in every],
        )
        return Known(
            tuple(states),
            frozenset(tag_id for tag_id, tag in tags if tag.observed_ns is not None),
            placed_ns,
            scans,
            looks,
        )


def copies(connection: sqlite3.Connection, run: Run, carries: Carries) -> list[Row]:
    """What is known in a run, as rows of another one, or of a step, that begins now.

    The rows that the fold rests on, in the order of their tags, of a tag in the order in which
    they count, with the stamps that they have there.
    """
    known = fold(connection, run.root, FOREVER_NS, run.begun_seq)
    found: dict[str, list[tuple[int, int, ScanRow | LookRow]]] = {
        tag.tag_id: [] for tag in known.tags
    }
    if carries is Carries.ALL:
        for seq, row in listed_rows(connection, run.root, known.scans, known.looks):
            found[row.tag_id].append((row.stamp_ns, seq, row))
    rows: list[Row] = []
    for tag in known.tags:
        placed_ns = known.placed_ns.get(tag.tag_id)
        if carries is not Carries.NOTHING and tag.pose is not None and placed_ns is not None:
            rows.append(PinRow(tag.tag_id, placed_ns, run.begun.arrival_ns, tag.pose))
        mine = sorted(found[tag.tag_id], key=lambda entry: entry[:2])
        if mine and tag.tag_id not in known.observed:
            # How long nothing has been observed there.
            rows.append(replace(mine[0][2], stamp_ns=tag.last_observed_ns or 0))
        rows += [row for *_, row in mine]
    return rows


class _Tag:
    """What is gathered of one tag."""

    __slots__ = (
        "failed_ns",
        "first_seq",
        "flower",
        "looked_ns",
        "observed_ns",
        "pose",
        "readings",
        "scans",
        "tried",
    )

    def __init__(self, first_seq: int) -> None:
        self.first_seq = first_seq
        self.pose: Pose | None = None
        self.scans: list[tuple[int, int, tuple[Reading, ...]]] = []
        self.observed_ns: int | None = None
        self.failed_ns: int | None = None
        self.looked_ns: int | None = None
        self.flower = NO_FLOWER
        self.tried: tuple[int, int, int, str] | None = None

    def take(self, seq: int, stamp_ns: int, status: int, detail: str) -> None:
        tried = self.tried
        if tried is None or (stamp_ns, seq) >= (tried[1], tried[0]):
            self.tried = (seq, stamp_ns, status, detail)

    def read(self, seq: int, stamp_ns: int, readings: tuple[Reading, ...]) -> None:
        if self.observed_ns is None or stamp_ns > self.observed_ns:
            self.observed_ns = stamp_ns
        if readings:
            self.scans.append((stamp_ns, seq, readings))

    def latest(self) -> tuple[Reading, ...]:
        """The latest of each sensor, in the order in which the sensors were first heard of."""
        kept: dict[str, tuple[int, int, Reading]] = {}
        for stamp_ns, seq, readings in self.scans:
            for reading in readings:
                entry = kept.get(reading.name)
                if entry is None or (stamp_ns, seq) >= entry[:2]:
                    kept[reading.name] = (stamp_ns, seq, reading)
        return tuple(reading for *_, reading in kept.values())[:MAX_SENSORS_PER_TAG]


def _readings(rows: list[tuple[Any, ...]]) -> list[tuple[Reading, ...]]:
    """The readings of rows as `_SCANS` names them."""
    sets = {text: sensor_names(text) for text in {row[3] for row in rows}}
    names = [sets[row[3]] for row in rows]
    values = numbers_of([row[8] for row in rows])
    lengths = [len(row) for row in values]
    if lengths != list(map(len, names)):
        raise DamagedFile("a scan has another number of readings than its series has sensors")
    stamps = [repeat(row[5], length) for row, length in zip(rows, lengths, strict=True)]
    # 50,000 in a large house: most of what a state takes.
    made = make_many(
        Reading,
        sum(lengths),
        chain.from_iterable(names),
        chain.from_iterable(values),
        chain.from_iterable(stamps),
    )
    ends = list(accumulate(lengths))
    return [tuple(made[end - length : end]) for end, length in zip(ends, lengths, strict=True)]
