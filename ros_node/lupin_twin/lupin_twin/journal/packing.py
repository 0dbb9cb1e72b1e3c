"""Readings, flowers and rollups as bytes, with a check that tells a flipped bit.

Pure. Numbers are little-endian. Nothing is rounded: numbers that float32 holds exactly are kept as
that, all others as float64. The last two bytes are the low half of a CRC-32 over the row's
own columns and the bytes before: SQLite has no checksums, and a wrong value must not pass for one.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

from lupin_twin.state import Bloom, Flower

_CHECK = struct.Struct("<H")


class Damaged(ValueError):
    """Bytes that are not what was written."""


def seal(columns: bytes, body: bytes) -> bytes:
    """The body with the check over it and the row's other columns behind it."""
    return body + _CHECK.pack(zlib.crc32(body, zlib.crc32(columns)) & 0xFFFF)


def unseal(columns: bytes, sealed: bytes) -> bytes:
    """The body of what `seal` gave.

    Raises:
        Damaged: the check does not fit.

    """
    if len(sealed) < _CHECK.size or seal(columns, sealed[: -_CHECK.size]) != sealed:
        raise Damaged("the check of a row does not fit")
    return sealed[: -_CHECK.size]


def columns(*values: int | str | None) -> bytes:
    """The row's other columns, for the check."""
    return " ".join(map(str, values)).encode("utf-8", "surrogatepass")


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


def unpack_shape(
    packed: bytes,
) -> tuple[float, tuple[Bloom, ...], tuple[tuple[float, float, float], ...]]:
    """(confidence, blooms, footprint) of what `pack_shape` packed.

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
        numbers = iter(unpack_numbers(packed[at:], 1 + 5 * bloom_count + 3 * corner_count))
        confidence = next(numbers)
        blooms = []
        for anomaly, index in marks:
            x, y, z, height_m, sure = (next(numbers) for _ in range(5))
            blooms.append(Bloom(x, y, z, height_m, species[index], sure, anomaly))
        corners = tuple((next(numbers), next(numbers), next(numbers)) for _ in range(corner_count))
    except (struct.error, UnicodeDecodeError, IndexError) as error:
        raise Damaged(f"a look cannot be read: {error}") from error
    return confidence, tuple(blooms), corners


@dataclass(slots=True)
class Bucket:
    """Finite readings of one sensor in one hour: how many, their mean, the least and the largest.

    `low` and `high` are kept as float32.
    """

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


_COUNT_SHORT, _COUNT_LONG = struct.Struct("<Hdff"), struct.Struct("<Idff")
_FLOAT32_MAX = 3.4028234663852886e38


def pack_buckets(buckets: Sequence[Bucket]) -> bytes:
    """One hour of a tag's sensors, in the order of their set."""
    layout = _COUNT_SHORT if all(bucket.n <= 0xFFFF for bucket in buckets) else _COUNT_LONG
    return b"".join(
        layout.pack(
            bucket.n,
            bucket.mean,
            max(-_FLOAT32_MAX, min(_FLOAT32_MAX, bucket.low)),
            max(-_FLOAT32_MAX, min(_FLOAT32_MAX, bucket.high)),
        )
        for bucket in buckets
    )


def unpack_buckets(packed: bytes, count: int) -> list[Bucket]:
    """What `pack_buckets` packed, of `count` sensors.

    Raises:
        Damaged: it is of no length that so many have.

    """
    for layout in (_COUNT_SHORT, _COUNT_LONG):
        if layout.size * count == len(packed):
            return [
                Bucket(*numbers) if numbers[0] else Bucket()
                for numbers in layout.iter_unpack(packed)
            ]
    raise Damaged(f"{len(packed)} bytes are not the rollup of {count} sensors")
