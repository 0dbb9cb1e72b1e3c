from __future__ import annotations

import math
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lupin_twin.journal.packing import (
    Bucket,
    Damaged,
    columns,
    pack_buckets,
    pack_numbers,
    pack_shape,
    seal,
    unpack_buckets,
    unpack_numbers,
    unpack_shape,
    unseal,
)
from lupin_twin.state import Bloom, Flower

numbers = st.lists(st.floats(), max_size=64)


def bits(values: tuple[float, ...] | list[float]) -> list[bytes]:
    return [struct.pack("<d", value) for value in values]


@given(numbers)
def test_numbers_come_back_to_the_last_bit(values: list[float]) -> None:
    assert bits(unpack_numbers(pack_numbers(values), len(values))) == bits(values)


def test_numbers_that_float32_holds_take_four_bytes_each() -> None:
    assert len(pack_numbers([21.5, 40.0, math.inf])) == 12
    assert len(pack_numbers([21.5, 0.1])) == 16
    assert len(pack_numbers([1e300])) == 8


def test_bytes_of_no_fitting_length_are_damage() -> None:
    with pytest.raises(Damaged, match="7 bytes are not 1 numbers"):
        unpack_numbers(b"1234567", 1)


@given(st.binary(max_size=50), st.integers(min_value=0), st.integers(min_value=0, max_value=7))
def test_a_flipped_bit_is_seen(body: bytes, at: int, bit: int) -> None:
    sealed = bytearray(seal(columns(1, 2, None), body))
    assert unseal(columns(1, 2, None), bytes(sealed)) == body
    sealed[at % len(sealed)] ^= 1 << bit
    with pytest.raises(Damaged):
        unseal(columns(1, 2, None), bytes(sealed))


def test_a_changed_column_is_seen() -> None:
    with pytest.raises(Damaged):
        unseal(columns(1, 3, None), seal(columns(1, 2, None), b"12"))


def test_too_short_is_damage() -> None:
    with pytest.raises(Damaged):
        unseal(b"", b"1")


names = st.text(st.characters(exclude_categories=()), max_size=20)
blooms = st.builds(
    Bloom, *(st.floats(allow_nan=False),) * 4, names, st.floats(allow_nan=False), st.booleans()
)
corners = st.tuples(*(st.floats(allow_nan=False),) * 3)
flowers = st.builds(
    Flower,
    confidence=st.floats(allow_nan=False),
    blooms=st.lists(blooms, max_size=5).map(tuple),
    footprint=st.lists(corners, max_size=5).map(tuple),
)


@given(flowers)
def test_a_look_comes_back(flower: Flower) -> None:
    shape = unpack_shape(pack_shape(flower))
    assert shape == (flower.confidence, flower.blooms, flower.footprint)


@given(flowers)
def test_part_of_a_look_is_damage(flower: Flower) -> None:
    for missing in (1, 3):
        with pytest.raises(Damaged):
            unpack_shape(pack_shape(flower)[:-missing])
    with pytest.raises(Damaged):
        unpack_shape(b"")


finite = st.floats(min_value=-1e9, max_value=1e9)


@given(st.lists(finite, max_size=20), st.lists(finite, max_size=20))
def test_merged_buckets_count_as_one(some: list[float], others: list[float]) -> None:
    one, other, both = Bucket(), Bucket(), Bucket()
    for value in some:
        one.add(value)
    for value in others:
        other.add(value)
    for value in (*some, *others):
        both.add(value)
    one.merge(other)
    assert (one.n, one.low, one.high) == (both.n, both.low, both.high)
    assert one.mean == pytest.approx(both.mean, rel=1e-9, abs=1e-6)


@pytest.mark.parametrize("n", [1, 65_535, 65_536])
def test_buckets_come_back(n: int) -> None:
    buckets = [Bucket(n, 0.1, -1.5, 2.5), Bucket()]
    assert unpack_buckets(pack_buckets(buckets), 2) == buckets


def test_a_bucket_past_float32_keeps_all_of_it() -> None:
    (bucket,) = unpack_buckets(pack_buckets([Bucket(1, 1e300, 1e300, 1e300)]), 1)
    assert bucket.mean == 1e300
    assert bucket.high == bucket.low == 1e300


def test_buckets_of_no_fitting_length_are_damage() -> None:
    with pytest.raises(Damaged):
        unpack_buckets(b"123", 1)
