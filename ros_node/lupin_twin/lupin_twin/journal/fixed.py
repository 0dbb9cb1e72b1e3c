"""What never changes once it was heard: where tags are, and what they are called.

The readers of a file keep what they have found of that, and look only for what was added since: of
the states of many moments it is a quarter of the work.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple, TypeVar

import numpy as np

from lupin_twin.journal.columns import Ints, fetch, unpacked, whole
from lupin_twin.journal.schema import Reader
from lupin_twin.making import make_many
from lupin_twin.state import Pose

# What is kept at most of a file: the places of so many runs, and the names.
_MOST_KEPT: Final = 8
# Before the first row of a table.
_FIRST: Final = -(2**63)

KeptT = TypeVar("KeptT")


class Places(NamedTuple):
    """Tags by their numbers, each with the stamp and the place of its pin."""

    tags: Ints
    stamps: Ints
    poses: Sequence[Pose]


def places_of(connection: sqlite3.Connection, run: int, until_ns: int) -> Places:
    """The tags that were pinned in a run up to a moment; without the damaged."""
    pins = connection.execute("SELECT count(*), max(id) FROM pin WHERE run = ?", (run,)).fetchone()
    every = _kept(connection, run, pins, lambda after: _places(connection, run, after), _all_places)
    are_known = every.stamps <= until_ns
    if are_known.all():
        return every
    rows = np.flatnonzero(are_known)
    poses = [every.poses[row] for row in rows.tolist()]
    return Places(every.tags[rows], every.stamps[rows], poses)


def _places(connection: sqlite3.Connection, run: int, after: int) -> tuple[int, Places]:
    found = fetch(
        connection,
        ("tag", "stamp_ns", "lag_us"),
        ("pose",),
        "FROM pin WHERE run = ? AND id > ?",
        (run, after),
    )
    rows_found = len(found)
    is_whole = whole((np.full(len(found), run), *found.numbers), *found.packed)
    is_whole &= np.isin(found.packed[0].lengths, (7 * 4 + 2, 7 * 8 + 2))
    if not is_whole.all():
        found = found.those(is_whole)
    poses: list[Pose] = [_NOWHERE] * len(found)
    for rows, sealed in found.packed[0].by_length():
        numbers = unpacked(sealed, 7)
        assert numbers is not None
        for row, pose in zip(
            rows.tolist(), make_many(Pose, len(rows), *numbers.T.tolist()), strict=True
        ):
            poses[row] = pose
    return rows_found, Places(found.numbers[0], found.numbers[1], poses)


def _all_places(known: Places, added: Places) -> Places:
    return Places(
        np.concatenate((known.tags, added.tags)),
        np.concatenate((known.stamps, added.stamps)),
        [*known.poses, *added.poses],
    )


_NOWHERE: Final = Pose(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def tag_ids_of(connection: sqlite3.Connection, tags: Ints) -> list[str]:
    """The ids of tags by their numbers, which ascend; empty where there is none."""
    named = connection.execute("SELECT count(*), max(id) FROM tag").fetchone()
    numbers, ids = _kept(connection, "tag", named, lambda after: _ids(connection, after), _all_ids)
    if len(tags) == len(numbers) and (tags == numbers).all():
        return list(ids)
    rows = np.minimum(np.searchsorted(numbers, tags), max(0, len(numbers) - 1))
    return [
        ids[row] if is_there else ""
        for row, is_there in zip(rows.tolist(), np.isin(tags, numbers).tolist(), strict=True)
    ]


def _ids(connection: sqlite3.Connection, after: int) -> tuple[int, tuple[Ints, list[str]]]:
    found = fetch(
        connection,
        ("id",),
        ("CAST(tag_id AS BLOB)",),
        "FROM tag NOT INDEXED WHERE id > ?",  # ascending
        (after,),
    )
    numbers, texts = found.numbers[0], found.packed[0]
    try:
        ascii_text = texts.data.decode("ascii")
    except UnicodeDecodeError:
        return len(numbers), (
            numbers,
            [text.decode("utf-8", "replace") for text in texts.slices()],
        )
    ends = np.cumsum(texts.lengths)
    starts = ends - texts.lengths
    ids = [ascii_text[a:b] for a, b in zip(starts.tolist(), ends.tolist(), strict=True)]
    return len(numbers), (numbers, ids)


def _all_ids(
    known: tuple[Ints, list[str]], added: tuple[Ints, list[str]]
) -> tuple[Ints, list[str]]:
    return np.concatenate((known[0], added[0])), [*known[1], *added[1]]


@dataclass(frozen=True, slots=True)
class _Rows:
    """What so many rows say, of which `last` is the last."""

    count: int
    last: int
    value: Any


def _kept(
    connection: sqlite3.Connection,
    what: object,
    are: tuple[int, int | None],
    find: Callable[[int], tuple[int, KeptT]],
    joined: Callable[[KeptT, KeptT], KeptT],
) -> KeptT:
    """What is known of so many rows, up to that one; `find` looks for those after a row."""
    count, last = are[0], are[1] or 0
    kept = connection.kept if isinstance(connection, Reader) else {}
    known: _Rows | None = kept.get(what)
    if known is not None and (known.count, known.last) == (count, last):
        value: KeptT = known.value
        return value
    rows, found = find(_FIRST if known is None else known.last)
    if known is None:
        value = found
    elif known.count + rows == count:
        value = joined(known.value, found)
    else:  # as of a moment before, or some were purged
        _, value = find(_FIRST)
    if len(kept) >= _MOST_KEPT:
        kept.clear()
    kept[what] = _Rows(count, last, value)
    return value
