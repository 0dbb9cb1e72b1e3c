"""Snapshot to CBOR (RFC 8949): what `state_json` writes, to the last field.

Pure. A tag is encoded when it changes, by way of its JSON, and kept like that, but for its ages.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable
from typing import Any, ClassVar, Final

import cbor2
import orjson

from lupin_bridge.stream.state_json import OWN_TIME, StateJson, header
from lupin_twin.state import Snapshot

# Major types (RFC 8949, section 3.1).
_ARRAY: Final = 4
_MAP: Final = 5
_FLOAT64: Final = 0xFB


def _head(major_type: int, length: int) -> bytes:
    """The shortest head of an array or a map (RFC 8949, section 4.2.1)."""
    for bits, (argument, limit) in zip("BBHIQ", _ARGUMENTS, strict=True):
        if length < limit:
            if argument is None:
                return bytes([major_type << 5 | length])
            return struct.pack(f">B{bits}", major_type << 5 | argument, length)
    raise AssertionError(length)


_ARGUMENTS: Final = ((None, 24), (24, 1 << 8), (25, 1 << 16), (26, 1 << 32), (27, 1 << 64))


def array(items: Iterable[bytes]) -> bytes:
    """Items that are encoded already as an array."""
    items = list(items)
    return b"".join([_head(_ARRAY, len(items)), *items])


def mapping(fields: Iterable[tuple[str, bytes]]) -> bytes:
    """Fields whose values are encoded already as a map."""
    fields = list(fields)
    pieces = [piece for name, value in fields for piece in (cbor2.dumps(name), value)]
    return b"".join([_head(_MAP, len(fields)), *pieces])


class StateCbor(StateJson):
    """Writes snapshots as CBOR and keeps what unchanged tags are in it."""

    null: ClassVar[bytes] = b"\xf6"
    # It cannot occur inside a string: no UTF-8 has its last byte.
    no_age: ClassVar[bytes] = cbor2.dumps("stale_seconds") + null

    @staticmethod
    def write(fields: dict[str, Any]) -> bytes:
        """A tag's fields, NaN and infinity as null: those that its JSON has."""
        return cbor2.dumps(orjson.loads(orjson.dumps(fields)))

    @staticmethod
    def write_age(stale_seconds: float) -> bytes:
        """The number that JSON has."""
        return struct.pack(">Bd", _FLOAT64, round(stale_seconds, 3))

    def state(self, snapshot: Snapshot, now_ns: int | None = OWN_TIME) -> bytes:
        """The snapshot as CBOR of `schema.TwinState`, ages as of `now_ns`, or of its own time."""
        if now_ns == OWN_TIME:
            now_ns = snapshot.now_ns
        return mapping(
            [
                ("header", cbor2.dumps(header(snapshot.stamp_ns, snapshot.frame_id))),
                ("tags", array([self.tag(tag, now_ns) for tag in snapshot.tags])),
            ]
        )
