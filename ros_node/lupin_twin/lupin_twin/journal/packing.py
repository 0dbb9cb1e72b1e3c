"""Readings, flowers and rollups as bytes, with a check that tells a flipped bit.

Pure. Numbers are little-endian. Nothing is rounded: numbers that float32 holds exactly are kept as
that, all others as float64. The last two bytes are a check over the row's own columns and the bytes
before: SQLite has no checksums, and a wrong value must not pass for one. It is the high half of
Adler-32 (RFC 1950, section 8.2), which any one byte that is wrong changes, and which, being a
weighted sum, `columns` computes for many rows at once.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

from lupin_twin.state import Bloom, Flower

_CHECK = struct.Struct("<H")


class Damaged(ValueError):
    """Bytes that are not what was written."""


def seal(columns: bytes, body: bytes) -> bytes:
    """The body with the check over the row's other columns and it behind it."""
    return body + _CHECK.pack(zlib.adler32(body, zlib.adler32(columns)) >> 16)


def unseal(columns: bytes, sealed: object) -> bytes:
    """The body of what `seal` gave.

    Raises:
        Damaged: the check does not fit, or a flipped bit has made something else of the bytes.

    """
    if not isinstance(sealed, bytes) or seal(columns, sealed[: -_CHECK.size]) != sealed:
        raise Damaged("the check of a row does not fit")
    return sealed[: -_CHECK.size]


# What stands for no value among a row's columns.
NOTHING = -(2**63)
_COLUMN = struct.Struct("<q")


def columns(*values: int | str | None) -> bytes:
    """The row's other columns, for the check: eight bytes a number or nothing, texts as they are.

    `columns.whole` checks many rows at once by the same rule.

    Raises:
        Damaged: a column is none of these.

    """
    try:
        return b"".join(
            value.encode("utf-8", "surrogatepass")
            if isinstance(value, str)
            else _COLUMN.pack(NOTHING if value is None else value)
            for value in values
        )
    except struct.error as error:
        raise Damaged(f"a column is no number that fits: {error}") from error


@lru_cache(maxsize=256)
def _layout(count: int, letter: str) -> struct.Struct:
    return struct.Struct(f"<{count}{letter}")


def pack_numbers(values: Sequence[float]) -> bytes:
    """Four bytes each if float32 holds all of them exactly, else eight."""
    wide = _layout(len(values), "d")
    exact = wide.pack(*values)
    narrow = _layout(len(values), "f")
    try:
        short = narrow.pack(*values)
    except OverflowError:
        return exact
    return short if wide.pack(*narrow.unpack(short)) == exact else exact


def unpack_numbers(packed: bytes, count: int) -> tuple[float, ...]:
    """What `pack_numbers` packed.

    Raises:
        Damaged: it is of no length that so many numbers have.

    """
    for letter in "df":
        layout = _layout(count, letter)
        if layout.size == len(packed):
            return layout.unpack(packed)
    raise Damaged(f"{len(packed)} bytes are not {count} numbers")


_FLOWER = struct.Struct("<HHH")  # flowers, corners of the footprint, species named
_NAME = struct.Struct("<H")
_BLOOM = struct.Struct("<?H")  # anomaly, index of its species


def pack_shape(flower: Flower) -> bytes:
    """A look's confidence, flowers and footprint; its other fields are columns."""
    species = list(dict.fromkeys(bloom.species for bloom in flower.blooms))
    texts = [name.encode("utf-8", "surrogatepass") for name in species]
    at = {name: index for index, name in enumerate(species)}
    numbers = [flower.confidence]
    for bloom in flower.blooms:
        numbers += (bloom.x, bloom.y, bloom.z, bloom.height_m, bloom.confidence)
    for corner in flower.footprint:
        numbers += corner
    return b"".join(
        (
            _FLOWER.pack(len(flower.blooms), len(flower.footprint), len(species)),
            *(_NAME.pack(len(text)) + text for text in texts),
            *(_BLOOM.pack(bloom.anomaly, at[bloom.species]) for bloom in flower.blooms),
            pack_numbers(numbers),
        )
    )


class ShapeKind(NamedTuple):
    """What a packed look says before its numbers, which begin at `start`.

    `marks` are (anomaly, species) of each flower.
    """

    start: int
    marks: tuple[tuple[bool, str], ...]
    corners: int

    @property
    def numbers(self) -> int:
        """How many follow: the confidence, five of each flower, three of each corner."""
        return 1 + 5 * len(self.marks) + 3 * self.corners


def shape_kind(packed: bytes) -> ShapeKind:
    """The beginning of what `pack_shape` packed.

    Raises:
        Damaged: it is not whole.

    """
    try:
        bloom_count, corner_count, species_count = _FLOWER.unpack_from(packed)
        at = _FLOWER.size
        species = []
        for _ in range(species_count):
            (length,) = _NAME.unpack_from(packed, at)
            at += _NAME.size
            species.append(packed[at : at + length].decode("utf-8", "surrogatepass"))
            at += length
        marks = [_BLOOM.unpack_from(packed, at + i * _BLOOM.size) for i in range(bloom_count)]
        at += bloom_count * _BLOOM.size
        return ShapeKind(at, tuple((odd, species[index]) for odd, index in marks), corner_count)
    except (struct.error, UnicodeDecodeError, IndexError) as error:
        raise Damaged(f"a look cannot be read: {error}") from error


def unpack_shape(
    packed: bytes,
) -> tuple[float, tuple[Bloom, ...], tuple[tuple[float, float, float], ...]]:
    """(confidence, blooms, footprint) of what `pack_shape` packed.

    Raises:
        Damaged: it is not whole.

    """
    kind = shape_kind(packed)
    numbers = iter(unpack_numbers(packed[kind.start :], kind.numbers))
    confidence = next(numbers)
    blooms = []
    for anomaly, species in kind.marks:
        x, y, z, height_m, sure = (next(numbers) for _ in range(5))
        blooms.append(Bloom(x, y, z, height_m, species, sure, anomaly))
    corners = tuple((next(numbers), next(numbers), next(numbers)) for _ in range(kind.corners))
    return confidence, tuple(blooms), corners


@dataclass(slots=True)
class Bucket:
    """Finite readings of one sensor in a while: how many, their mean, the least and the largest."""

    n: int = 0
    mean: float = 0.0
    low: float = float("inf")
    high: float = float("-inf")

    def add(self, value: float) -> None:
        """Count a finite reading."""
        self.n += 1
        self.mean += (value - self.mean) / self.n
        self.low = min(self.low, value)
        self.high = max(self.high, value)

    def merge(self, other: Bucket) -> None:
        """Count what another bucket has counted."""
        if other.n:
            self.n += other.n
            self.mean += (other.mean - self.mean) * (other.n / self.n)
            self.low = min(self.low, other.low)
            self.high = max(self.high, other.high)


# By what a sensor takes in them: the least and the largest as float32 where that holds all exactly.
_LAYOUTS = {
    layout.size: layout for layout in map(struct.Struct, ("<Hdff", "<Idff", "<Hddd", "<Iddd"))
}
_NARROW = struct.Struct("<ff")


def pack_buckets(buckets: Sequence[Bucket]) -> bytes:
    """One hour of a tag's sensors, in the order of their set."""
    count = "H" if all(bucket.n <= 0xFFFF for bucket in buckets) else "I"
    ends = "ff" if all(map(_is_narrow, buckets)) else "dd"
    layout = struct.Struct(f"<{count}d{ends}")
    return b"".join(
        layout.pack(bucket.n, bucket.mean, bucket.low, bucket.high) for bucket in buckets
    )


def _is_narrow(bucket: Bucket) -> bool:
    ends = (bucket.low, bucket.high)
    try:
        return _NARROW.unpack(_NARROW.pack(*ends)) == ends
    except OverflowError:
        return False


def unpack_buckets(packed: bytes, count: int) -> list[Bucket]:
    """What `pack_buckets` packed, of `count` sensors.

    Raises:
        Damaged: it is of no length that so many have.

    """
    return [Bucket(*numbers) for numbers in _layout_of(packed, count).iter_unpack(packed)]


def _layout_of(packed: bytes, count: int) -> struct.Struct:
    layout = _LAYOUTS.get(len(packed) // count) if count else None
    if layout is None or layout.size * count != len(packed):
        raise Damaged(f"{len(packed)} bytes are not the rollup of {count} sensors")
    return layout
