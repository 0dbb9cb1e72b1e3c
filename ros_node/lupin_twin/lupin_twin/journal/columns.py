"""Many rows at once: fetched as columns, and checked and unpacked together.

A row that comes to Python one by one costs a microsecond and more, and lets go of the interpreter
each time. Here SQLite puts each column into one text, without the interpreter, and numpy takes it
apart. All texts of one query have the same rows in the same order.
"""

from __future__ import annotations

import sqlite3
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lupin_twin.journal.packing import NOTHING, columns

Ints = NDArray[np.int64]

_CHECK_BYTES: Final = 2
_ADLER: Final = 65521
# So long may a row be for all of Adler's sums over it to be below 2**24.
_NARROW: Final = 362
_NOTHING: Final = columns(None)


@dataclass(frozen=True, slots=True)
class Packed:
    """Bytes of many rows, one behind the other: so many of each."""

    data: bytes
    lengths: Ints

    def slices(self, rows: Ints | None = None) -> list[bytes]:
        """The bytes of each row, or of some."""
        ends = np.cumsum(self.lengths)
        starts = ends - self.lengths
        if rows is not None:
            starts, ends = starts[rows], ends[rows]
        data = self.data
        return [data[start:end] for start, end in zip(starts.tolist(), ends.tolist(), strict=True)]

    def those(self, rows: Ints) -> Packed:
        """Some of the rows, in that order."""
        return Packed(b"".join(self.slices(rows)), self.lengths[rows])

    def by_length(self) -> Iterator[tuple[Ints, NDArray[np.uint8]]]:
        """(rows, their bytes, a row each), for all rows of one length at a time."""
        data = np.frombuffer(self.data, dtype=np.uint8)
        count = len(self.lengths)
        if not count:
            return
        if self.lengths.min() == self.lengths.max():
            yield np.arange(count), data.reshape(count, int(self.lengths[0]))
            return
        starts = np.cumsum(self.lengths) - self.lengths
        for length in distinct(self.lengths).tolist():
            rows = np.flatnonzero(self.lengths == length)
            yield rows, data[starts[rows][:, None] + np.arange(length)]


@dataclass(frozen=True, slots=True)
class Columns:
    """What a query found: a column of numbers for each that was named, and of bytes."""

    numbers: tuple[Ints, ...]
    packed: tuple[Packed, ...]

    def __len__(self) -> int:
        return len(self.numbers[0])

    def those(self, rows: NDArray[np.bool_]) -> Columns:
        """Some of the rows."""
        some = np.flatnonzero(rows)
        return Columns(
            tuple(number[some] for number in self.numbers),
            tuple(packed.those(some) for packed in self.packed),
        )


def fetch(
    connection: sqlite3.Connection,
    numbers: Sequence[str],
    packed: Sequence[str],
    found: str,
    values: Sequence[object],
    *,
    seldom: Sequence[str] = (),
    seldom_packed: Sequence[str] = (),
) -> Columns:
    """`found` is a query's part from FROM on; columns come in the order of the arguments.

    All are expressions; `numbers` and `packed` are never NULL, and the first number is different
    for each row. What is seldom there comes as `NOTHING`, or empty, where it is NULL. In a damaged
    row anything may be anything: it comes as numbers and bytes all the same, for the check to see.
    """
    wanted = _Wanted(numbers, packed, seldom, seldom_packed)
    try:
        return _fetched(connection, wanted, found, values)
    except _Odd:
        return _fetched(connection, wanted.forced(), found, values)


class _Odd(Exception):
    """A column of numbers is not all numbers, or not one for each row."""


class _Wanted(NamedTuple):
    numbers: Sequence[str]
    packed: Sequence[str]
    seldom: Sequence[str]
    seldom_packed: Sequence[str]

    def forced(self) -> _Wanted:
        """The same, made numbers and bytes whatever it is."""
        return _Wanted(
            [f"ifnull(CAST({number} AS INTEGER), 0)" for number in self.numbers],
            [f"ifnull(CAST({one} AS BLOB), x'')" for one in self.packed],
            [f"CAST({one} AS INTEGER)" for one in self.seldom],
            [f"CAST({one} AS BLOB)" for one in self.seldom_packed],
        )


def _fetched(
    connection: sqlite3.Connection, wanted: _Wanted, found: str, values: Sequence[object]
) -> Columns:
    numbers, packed, seldom, seldom_packed = wanted
    texts = [f"group_concat({number})" for number in numbers]
    for one in packed:
        texts += [f"group_concat(length({one}))", _bytes(one)]
    for one in (*seldom, *seldom_packed):
        texts.append(f"group_concat({numbers[0]}) FILTER (WHERE {one} IS NOT NULL)")
    texts += [f"group_concat({one})" for one in seldom]
    for one in seldom_packed:
        texts += [f"group_concat(length(CAST({one} AS BLOB)))", _bytes(one)]
    row = iter(connection.execute(f"SELECT {', '.join(texts)} {found}", tuple(values)).fetchone())
    often = [_ints(next(row)) for _ in numbers]
    often_packed = [_packed(row) for _ in packed]
    where = [np.flatnonzero(np.isin(often[0], _ints(next(row)))) for _ in (*seldom, *seldom_packed)]
    count = len(often[0])
    often += [_spread(rows, _ints(next(row)), count, NOTHING) for rows in where[: len(seldom)]]
    for rows in where[len(seldom) :]:
        some = _packed(row)
        often_packed.append(Packed(some.data, _spread(rows, some.lengths, count, 0)))
    made = Columns(tuple(often), tuple(often_packed))
    if any(len(column) != count for column in (*often, *(one.lengths for one in often_packed))):
        raise _Odd
    return made


def _bytes(expression: str) -> str:
    # A text is its bytes, and bytes are taken as a text without a look at them.
    return f"CAST(group_concat({expression}, '') AS BLOB)"


def _packed(row: Iterator[Any]) -> Packed:
    lengths, data = _ints(next(row)), next(row) or b""
    if int(lengths.sum()) != len(data):
        raise _Odd
    return Packed(data, lengths)


def _spread(rows: Ints, values: Ints, count: int, otherwise: int) -> Ints:
    if len(rows) != len(values):
        raise _Odd
    column = np.full(count, otherwise, dtype=np.int64)
    column[rows] = values
    return column


def distinct(numbers: Ints) -> Ints:
    """Each of them once, ascending: of some that nearly are, faster than `numpy.unique`.

    The first call of that one in a process takes 8 ms.
    """
    ascending = np.sort(numbers, kind="stable")
    is_first = np.append(True, ascending[1:] != ascending[:-1])[: len(ascending)]
    return np.compress(is_first, ascending)


def _ints(text: str | None) -> Ints:
    if not text:
        return np.zeros(0, dtype=np.int64)
    if text.encode().translate(None, b"0123456789,-"):
        raise _Odd
    return np.fromstring(text, dtype=np.int64, sep=",")


def whole(numbers: Sequence[Ints], sealed: Packed, text: Packed | None = None) -> NDArray[np.bool_]:
    """Which rows are what was written: `packing.unseal` for all of them.

    `numbers` are the row's columns in the order in which they were sealed, `text` the last of them,
    empty for none.
    """
    sums = _sums(np.stack([number.astype("<i8") for number in numbers], axis=1).view(np.uint8))
    if text is not None:
        sums = _joined(sums, _text_sums(text))
    is_whole = np.zeros(len(sealed.lengths), dtype=np.bool_)
    for rows, body in sealed.by_length():
        if body.shape[1] >= _CHECK_BYTES:
            told = np.ascontiguousarray(body[:, -_CHECK_BYTES:]).view("<u2")[:, 0]
            found = _joined(sums.of(rows), _sums(body[:, :-_CHECK_BYTES]))
            is_whole[rows] = found.second % _ADLER == told
    return is_whole


class _Sums(NamedTuple):
    """Adler's two sums of many byte strings, the first without its 1, and their lengths."""

    first: Ints
    second: Ints
    lengths: Ints

    def of(self, rows: Ints) -> _Sums:
        return _Sums(self.first[rows], self.second[rows], self.lengths[rows])


def _sums(data: NDArray[np.uint8]) -> _Sums:
    count, length = data.shape
    # Nothing is lost: a row is shorter than 2**26 bytes, and that of a usual house than 363, of
    # which float32 holds every sum in half the room.
    kind = np.float32 if length <= _NARROW else np.float64
    weights = np.stack([np.ones(length, kind), np.arange(length, 0, -1, dtype=kind)], axis=1)
    both = data.astype(kind) @ weights
    first, second = both.astype(np.int64).T
    return _Sums(first, second + length, np.full(count, length))


def _joined(one: _Sums, other: _Sums) -> _Sums:
    """The sums of the one's bytes with the other's behind them."""
    return _Sums(
        one.first + other.first,
        one.second + other.second + other.lengths * one.first,
        one.lengths + other.lengths,
    )


def _text_sums(text: Packed) -> _Sums:
    adler = np.full(len(text.lengths), zlib.adler32(_NOTHING), dtype=np.int64)
    rows = np.flatnonzero(text.lengths)
    adler[rows] = [zlib.adler32(each) for each in text.slices(rows)]
    lengths = np.where(text.lengths, text.lengths, len(_NOTHING))
    return _Sums((adler & 0xFFFF) - 1, adler >> 16, lengths)


def unpacked(sealed: NDArray[np.uint8], count: int) -> NDArray[np.float64] | None:
    """`count` numbers of each row, all of one length; None where so many have another.

    `packing.unpack_numbers` for many.
    """
    body = np.ascontiguousarray(sealed[:, :-_CHECK_BYTES])
    for kind, size in (("<f8", 8), ("<f4", 4)):
        if body.shape[1] == size * count:
            return body.view(kind).astype(np.float64)
    return None
