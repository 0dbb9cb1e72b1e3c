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
from collections.abc import Mapping
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


class _Numbers(NamedTuple):
    """Numbers of one size, in bytes, one after the other."""

    size: int
    number: int


class _Text(NamedTuple):
    path: str


class _Sequence(NamedTuple):
    """A sequence of elements with these parts, each of at least `min_bytes`."""

    path: str
    element: list[_Numbers | _Text | _Sequence]
    min_bytes: int
    limit: int | None


_Part = _Numbers | _Text | _Sequence


class _Walk:
    """A walk over a message's bytes; `elements_left` is how many it may still claim."""

    def __init__(self, data: bytes, max_elements: int) -> None:
        length = _LENGTHS.get(bytes(data[:2]))
        if length is None or len(data) < _HEADER_BYTES:
            raise MalformedError(f"its first bytes are {bytes(data[:4]).hex()!r}, not plain CDR's")
        self._data, self._end = data, len(data)
        self._length_at = length.unpack_from
        self._elements_left = max_elements

    def over(self, parts: list[_Part], at: int) -> int:
        """Walk over parts that begin at `at`; returns where they end, maybe after the last byte."""
        for part in parts:
            if isinstance(part, _Numbers):
                # Aligned from the end of the header.
                at += (_HEADER_BYTES - at) % part.size + part.size * part.number
                continue
            at += -at % 4 + 4
            if at > self._end:
                raise MalformedError(f"it ends within the length of {part.path}")
            count, left = int(self._length_at(self._data, at - 4)[0]), self._end - at
            if isinstance(part, _Sequence):
                at = self._over_sequence(part, count, at)
            elif count > left:
                raise MalformedError(f"{part.path} claims {count} bytes, {left} bytes are left")
            else:
                at += count
        return at

    def _over_sequence(self, part: _Sequence, count: int, at: int) -> int:
        if part.limit is not None and count > part.limit:
            raise TooManyError(f"{part.path}: {count}, the limit is {part.limit}")
        if count * part.min_bytes > self._end - at:
            raise MalformedError(
                f"{part.path}: {count} of at least {part.min_bytes} bytes are claimed, "
                f"{self._end - at} bytes are left"
            )
        if isinstance(part.element[0], _Numbers) and part.element[0].size == part.min_bytes:
            return self.over([_Numbers(part.min_bytes, count)], at) if count else at
        self._elements_left -= count
        if self._elements_left < 0:
            raise TooManyError(f"{part.path}: more elements in all sequences than the limit")
        for _ in range(count):
            at = self.over(part.element, at)
        return at


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
        self._parts = self._message(message_type, "")
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
        end = _Walk(data, self._max_elements).over(self._parts, _HEADER_BYTES)
        if end > len(data):
            raise MalformedError(f"it has {len(data)} bytes, its fields need {end}")
        return end

    def _message(self, message_type: Any, path: str) -> list[_Part]:
        """The parts of a message and of those in it, in order; numbers of one size become one."""
        parts: list[_Part] = []
        for name, kind in message_type.get_fields_and_field_types().items():
            for part in self._field(kind, f"{path}.{name}" if path else name):
                last = parts[-1] if parts else None
                if (
                    isinstance(part, _Numbers)
                    and isinstance(last, _Numbers)
                    and part.size == last.size
                ):
                    parts[-1] = _Numbers(part.size, last.number + part.number)
                else:
                    parts.append(part)
        return parts

    def _field(self, kind: str, path: str) -> list[_Part]:
        if kind in _SIZES:
            return [_Numbers(_SIZES[kind], 1)]
        if kind == "string":
            return [_Text(path)]
        if sequence := _SEQUENCE.fullmatch(kind):
            limit, element = self._limits.pop(path, None), self._field(sequence["element"], path)
            sizes = (
                part.size * part.number if isinstance(part, _Numbers) else 4 for part in element
            )
            return [_Sequence(path, element, sum(sizes), limit)]
        if array := _ARRAY.fullmatch(kind):
            return [_Numbers(_SIZES[array["number"]], int(array["count"]))]
        package, _, name = kind.partition("/")
        return self._message(getattr(import_module(f"{package}.msg"), name), path)


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
