from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import closing

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lupin_twin.journal.columns import Columns, Packed, distinct, fetch, unpacked, whole
from lupin_twin.journal.packing import NOTHING, Damaged, columns, pack_numbers, seal, unseal

INT64 = st.integers(-(2**63) + 1, 2**63 - 1)
TEXTS = st.text(min_size=1, max_size=20)
ROWS = st.lists(
    st.tuples(INT64, st.none() | INT64, st.none() | TEXTS, st.binary(max_size=30)), max_size=20
)


@pytest.fixture
def connection() -> Iterator[sqlite3.Connection]:
    with closing(sqlite3.connect(":memory:")) as made:
        made.execute("CREATE TABLE t (id INTEGER PRIMARY KEY, n INT, own INT, text TEXT, b BLOB)")
        yield made


def everything(connection: sqlite3.Connection) -> Columns:
    return fetch(
        connection, ("id", "n"), ("b",), "FROM t", (), seldom=("own",), seldom_packed=("text",)
    )


@given(rows=ROWS)
def test_columns_are_what_rows_are(
    rows: list[tuple[int, int | None, str | None, bytes]],
) -> None:
    with closing(sqlite3.connect(":memory:")) as connection:
        connection.execute("CREATE TABLE t (id INTEGER PRIMARY KEY, n INT, own INT, text, b BLOB)")
        connection.executemany("INSERT INTO t VALUES (NULL, ?, ?, ?, ?)", rows)
        found = everything(connection)
    assert len(found) == len(rows)
    numbers, own = found.numbers[1].tolist(), found.numbers[2].tolist()
    packed, texts = (each.slices() for each in found.packed)
    assert numbers == [row[0] for row in rows]
    assert own == [NOTHING if row[1] is None else row[1] for row in rows]
    assert texts == [(row[2] or "").encode() for row in rows]
    assert packed == [row[3] for row in rows]


@given(rows=ROWS, flip=st.none() | st.tuples(st.integers(0), st.integers(0), st.integers(1, 255)))
def test_what_is_whole_is_what_can_be_unsealed(
    rows: list[tuple[int, int | None, str | None, bytes]], flip: tuple[int, int, int] | None
) -> None:
    sealed = [bytearray(seal(columns(n, own, text), body)) for n, own, text, body in rows]
    if flip is not None and sealed:
        row, at, by = flip
        body = sealed[row % len(sealed)]
        body[at % len(body)] ^= by

    def is_whole(index: int) -> bool:
        n, own, text, _ = rows[index]
        try:
            unseal(columns(n, own, text), bytes(sealed[index]))
        except Damaged:
            return False
        return True

    def packed(each: list[bytes]) -> Packed:
        return Packed(b"".join(each), np.array([len(one) for one in each], dtype=np.int64))

    found = whole(
        (
            np.array([row[0] for row in rows], dtype=np.int64),
            np.array([NOTHING if row[1] is None else row[1] for row in rows], dtype=np.int64),
        ),
        packed([bytes(each) for each in sealed]),
        packed([(row[2] or "").encode() for row in rows]),
    )
    assert found.tolist() == [is_whole(index) for index in range(len(rows))]
    assert (flip is None) == found.all() or not rows


def test_what_is_too_short_for_a_check_is_not_whole() -> None:
    short = Packed(b"x", np.array([1, 0]))
    assert whole((np.array([5, 6]),), short).tolist() == [False, False]


@pytest.mark.parametrize("length", [361, 362, 363, 364])
def test_the_largest_sums_that_float32_holds_are_exact_and_so_are_larger_ones(length: int) -> None:
    sealed = seal(columns(7), b"\xff" * (length - 1) + b"\xfe")
    wrong = sealed[:-3] + b"\xff" + sealed[-2:]
    rows = Packed(sealed + wrong, np.array([len(sealed), len(wrong)]))
    assert whole((np.array([7, 7]),), rows).tolist() == [True, False]


@given(st.lists(st.integers(-3, 3)))
def test_each_number_is_told_once_in_their_order(numbers: list[int]) -> None:
    assert distinct(np.array(numbers, dtype=np.int64)).tolist() == sorted(set(numbers))


@pytest.mark.parametrize("numbers", [(0.5, 1.0), (0.1, float("nan"))])
def test_numbers_come_back(numbers: tuple[float, ...]) -> None:
    sealed = np.frombuffer(pack_numbers(numbers) + b"\0\0", dtype=np.uint8)[None, :]
    found = unpacked(sealed, 2)
    assert found is not None
    assert list(map(repr, found[0].tolist())) == list(map(repr, numbers))
    assert unpacked(sealed, 5) is None


def test_some_rows(connection: sqlite3.Connection) -> None:
    rows = [(1, None, "a", b"x"), (2, 5, None, b""), (3, None, "bc", b"yz")]
    connection.executemany("INSERT INTO t VALUES (NULL, ?, ?, ?, ?)", rows)
    some = everything(connection).those(np.array([True, False, True]))
    assert some.numbers[1].tolist() == [1, 3]
    assert [each.slices() for each in some.packed] == [[b"x", b"yz"], [b"a", b"bc"]]


def test_a_text_in_the_place_of_bytes_is_its_bytes(connection: sqlite3.Connection) -> None:
    rows = [(1, None, None, "heiß"), (2, None, None, b"y")]
    connection.executemany("INSERT INTO t VALUES (NULL, ?, ?, ?, ?)", rows)
    assert everything(connection).packed[0].slices() == ["heiß".encode(), b"y"]


def test_odd_values_of_a_damaged_row_do_no_harm_to_others(connection: sqlite3.Connection) -> None:
    rows = [
        (1, None, None, b"x"),
        (2.5, "own", 7, None),
        (None, b"z", b"abc", 4),
        (4, 5, "t", b"y"),
    ]
    connection.executemany("INSERT INTO t VALUES (NULL, ?, ?, ?, ?)", rows)
    found = everything(connection)
    assert found.numbers[0].tolist() == [1, 2, 3, 4]
    assert found.numbers[1].tolist()[::3] == [1, 4]
    assert found.numbers[2].tolist()[::3] == [NOTHING, 5]
    assert [each.slices()[::3] for each in found.packed] == [[b"x", b"y"], [b"", b"t"]]
