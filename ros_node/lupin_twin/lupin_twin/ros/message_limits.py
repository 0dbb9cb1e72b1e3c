"""Limits of the messages that are subscribed to, checked on the serialised bytes.

A deserialiser allocates as many elements as a message claims, and only then finds that they are
missing. Eight megabytes that claim to be eight million tags cost it more than a gigabyte. Here the
bytes are walked by the message's shape, and no objects are made from them. A length that cannot fit
into the bytes left, or exceeds one of our limits, is refused.

The encoding is plain CDR as ROS 2 has it on the wire (OMG DDSI-RTPS 2.5, 10.5, and CORBA 3.0,
15.3). Four bytes give the byte order; then each number is aligned to its own size, counted from the
end of those four. A text or a sequence is preceded by its length as a uint32.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from typing import Any, Final, NamedTuple

from diagnostic_msgs.msg import DiagnosticArray
from lupin_msgs.msg import DiscoveredTags, Observation, TwinState, TwinTimes
from nav_msgs.msg import OccupancyGrid

from lupin_twin.core.drops import (
    MAX_BLOOMS_PER_TAG,
    MAX_FOOTPRINT_POINTS,
    MAX_ITEMS,
    MAX_SENSORS_PER_TAG,
    MAX_TAGS,
)

# The two encapsulations of plain CDR, and how a uint32 is read in each.
_LENGTHS: Final = {b"\x00\x00": struct.Struct(">I"), b"\x00\x01": struct.Struct("<I")}
_HEADER_BYTES: Final = 4
_ALIGNMENTS: Final = 8

_SIZES: Final = {
    **dict.fromkeys(("boolean", "octet", "byte", "char", "int8", "uint8"), 1),
    **dict.fromkeys(("int16", "uint16"), 2),
    **dict.fromkeys(("int32", "uint32", "float"), 4),
    **dict.fromkeys(("int64", "uint64", "double"), 8),
}
_SEQUENCE: Final = re.compile(r"sequence<(?P<element>[^,]+)>")
_ARRAY: Final = re.compile(r"(?P<number>.+)\[(?P<count>\d+)\]")


class MalformedError(ValueError):
    """The bytes are not a message of this shape, or exceed a limit; says where and by how much."""


class TooManyError(MalformedError):
    """The message exceeds one of our limits; says which, and by how much."""


class _Reader:
    """A message that is being walked: its bytes, and how many elements it may still claim."""

    __slots__ = ("data", "elements_left", "end", "length_at")

    def __init__(self, data: bytes, max_elements: int) -> None:
        length = _LENGTHS.get(bytes(data[:2]))
        if length is None or len(data) < _HEADER_BYTES:
            raise MalformedError(f"its first bytes are {bytes(data[:4]).hex()!r}, not plain CDR's")
        self.data = data
        self.end = len(data)
        self.length_at = length.unpack_from
        self.elements_left = max_elements

    def length(self, at: int, what: str) -> int:
        if at + 4 > self.end:
            raise MalformedError(f"it ends within the length of {what}")
        return int(self.length_at(self.data, at)[0])


# Takes a reader and where a value begins; returns where the next one does.
_Walk = Callable[[_Reader, int], int]


class _Part(NamedTuple):
    """How to walk over a value, and its least size in bytes.

    `steps`, for a value of fixed size, is its size in bytes with padding, by the offset (modulo 8)
    at which it begins.
    """

    walk: _Walk
    min_bytes: int
    steps: tuple[int, ...] | None = None


class MessageShape:
    """The serialised form of a message type, and the limits of one message.

    `max_bytes` limits the whole message. `limits` has the most elements of a sequence, by its path
    (`tag_reading.readings`); `max_elements` limits those of all sequences of messages together.
    Sequences of plain numbers are limited by their bytes. Types must not be empty, and must not
    have bounded texts or sequences, or arrays of anything but numbers.

    Raises:
        ImportError: the type of a field is not installed.
        TypeError: there is no sequence with a limit's path.

    """

    def __init__(
        self,
        message_type: Any,
        *,
        max_bytes: int,
        limits: Mapping[str, int] | None = None,
        max_elements: int = 2**32,
    ) -> None:
        self.message_type = message_type
        self.max_bytes = max_bytes
        self._limits = dict(limits or {})
        self._max_elements = max_elements
        self._walk = self._message(message_type, "").walk
        if self._limits:
            raise TypeError(f"{message_type.__name__} has no sequences {sorted(self._limits)}")

    def check(self, data: bytes) -> int:
        """Check a message; returns how many bytes it takes. Bytes behind it are ignored.

        Raises:
            MalformedError: a length in `data` is impossible.
            TooManyError: the message exceeds a limit.

        """
        if len(data) > self.max_bytes:
            raise TooManyError(f"{len(data)} bytes, the limit is {self.max_bytes}")
        reader = _Reader(data, self._max_elements)
        end = self._walk(reader, _HEADER_BYTES)
        if end > reader.end:
            raise MalformedError(f"it has {reader.end} bytes, its fields need {end}")
        return end

    def _message(self, message_type: Any, path: str) -> _Part:
        fields = message_type.get_fields_and_field_types()
        return _in_a_row(
            [self._field(kind, f"{path}.{name}" if path else name) for name, kind in fields.items()]
        )

    def _field(self, kind: str, path: str) -> _Part:
        if kind in _SIZES:
            return _fixed(_SIZES[kind], 1)
        if kind == "string":
            return _text(path)
        if sequence := _SEQUENCE.fullmatch(kind):
            limit, element = self._limits.pop(path, None), sequence["element"]
            return _sequence(path, self._field(element, path), limit, element not in _SIZES)
        if array := _ARRAY.fullmatch(kind):
            return _fixed(_SIZES[array["number"]], int(array["count"]))
        package, _, name = kind.partition("/")
        return self._message(getattr(import_module(f"{package}.msg"), name), path)


def _fixed(size: int, count: int) -> _Part:
    """`count` numbers of `size` bytes, one after the other."""
    # Aligned from the end of the header, which has half the size of the largest number.
    return _of_steps(
        tuple((_HEADER_BYTES - begin) % size + size * count for begin in range(_ALIGNMENTS)),
        size * count,
    )


def _of_steps(steps: tuple[int, ...], min_bytes: int) -> _Part:
    return _Part(lambda _, at: at + steps[at % _ALIGNMENTS], min_bytes, steps)


def _in_a_row(parts: Sequence[_Part]) -> _Part:
    """Parts one after the other; adjacent ones of fixed size become one step."""
    merged: list[_Part] = []
    for part in parts:
        last = merged[-1] if merged else None
        if last is not None and last.steps is not None and part.steps is not None:
            steps = tuple(
                step + part.steps[(begin + step) % _ALIGNMENTS]
                for begin, step in enumerate(last.steps)
            )
            merged[-1] = _of_steps(steps, last.min_bytes + part.min_bytes)
        else:
            merged.append(part)
    if len(merged) == 1:
        return merged[0]
    walks = tuple(part.walk for part in merged)

    def walk(reader: _Reader, at: int) -> int:
        for one in walks:
            at = one(reader, at)
        return at

    return _Part(walk, sum(part.min_bytes for part in merged))


def _text(path: str) -> _Part:
    def walk(reader: _Reader, at: int) -> int:
        at += -at % 4
        length = reader.length(at, path)
        at += 4 + length
        if at > reader.end:
            left = reader.end - at + length
            raise MalformedError(f"{path} claims {length} bytes, {left} bytes are left")
        return at

    return _Part(walk, 4)


def _sequence(path: str, element: _Part, limit: int | None, is_counted: bool) -> _Part:
    min_bytes, walk_element = element.min_bytes, element.walk

    def walk(reader: _Reader, at: int) -> int:
        at += -at % 4
        count = reader.length(at, path)
        at += 4
        if limit is not None and count > limit:
            raise TooManyError(f"{path}: {count}, the limit is {limit}")
        if count * min_bytes > reader.end - at:
            raise MalformedError(
                f"{path}: {count} of at least {min_bytes} bytes are claimed, "
                f"{reader.end - at} bytes are left"
            )
        if is_counted:
            reader.elements_left -= count
            if reader.elements_left < 0:
                raise TooManyError(f"{path}: more elements in all sequences than the limit")
        if not is_counted:  # plain numbers, aligned to their own size
            padding = (_HEADER_BYTES - at) % min_bytes if count else 0
            return at + padding + count * min_bytes
        for _ in range(count):
            at = walk_element(reader, at)
        return at

    return _Part(walk, 4)


MAX_STATUSES: Final = 1_000
MAX_STATUS_VALUES: Final = 10_000

# An observation with 2,000 flowers has some 150 kB.
OBSERVATION: Final = MessageShape(
    Observation,
    max_bytes=1_000_000,
    limits={
        "tag_reading.readings": MAX_SENSORS_PER_TAG,
        "flower.flowers": MAX_BLOOMS_PER_TAG,
        "flower.box_footprint.points": MAX_FOOTPRINT_POINTS,
    },
)
# A discovery of 20,000 tags has 2.5 MB.
DISCOVERED_TAGS: Final = MessageShape(
    DiscoveredTags, max_bytes=8_000_000, limits={"tags": MAX_TAGS}
)
# A map of 4,000 × 4,000 cells has 16 MB.
MAP: Final = MessageShape(OccupancyGrid, max_bytes=64_000_000)
# 20,000 tags with ten sensors and forty flowers each have 48 MB. The twin that publishes the state
# limits how many a single tag has.
STATE: Final = MessageShape(
    TwinState,
    max_bytes=64_000_000,
    limits={"tags": MAX_TAGS},
    max_elements=MAX_TAGS + MAX_ITEMS,
)
# As many tags and readings, each reading with its name and its time.
TIMES: Final = MessageShape(
    TwinTimes,
    max_bytes=64_000_000,
    limits={"tags": MAX_TAGS},
    max_elements=MAX_TAGS + 2 * MAX_ITEMS,
)
# A twin reports about a dozen findings, with a few dozen values, in a few kB. Aggregators of a
# whole robot publish more, and all nodes share the topic.
DIAGNOSTICS: Final = MessageShape(
    DiagnosticArray,
    max_bytes=1_000_000,
    limits={"status": MAX_STATUSES},
    max_elements=MAX_STATUSES + MAX_STATUS_VALUES,
)
