"""ROS messages as rosbridge tells them: in JSON, and in CBOR with typed arrays. Pure.

What a message has is read off its own `get_fields_and_field_types`, once for each type.

- JSON: arrays of bytes (uint8, char) are base64, all others lists; no finite number: null.
- CBOR: arrays of bytes are byte strings, those of other numbers typed arrays (RFC 8746; little
  endian, as all machines that ROS runs on), and NaN stays NaN.

A time is `{sec, nanosec}` in both, as any other message.
"""

from __future__ import annotations

import re
from binascii import b2a_base64
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any, Final

import cbor2
import numpy as np
import orjson

Told = Callable[[Any], Any]

_ARRAY: Final = re.compile(r"sequence<(?P<kind>[\w/]+)(?:, \d+)?>|(?P<of>[\w/]+)\[\d+\]")
_BYTES: Final = frozenset(("uint8", "char"))
# https://www.rfc-editor.org/rfc/rfc8746#section-2.1
_TAGS: Final[Mapping[str, int]] = {
    "uint16": 69,
    "uint32": 70,
    "uint64": 71,
    "int8": 72,
    "int16": 77,
    "int32": 78,
    "int64": 79,
    "float": 85,
    "double": 86,
}
# Numbers that are written as JSON in one go: a millisecond's worth.
_PART: Final = 65_536
_PLAIN: Final = frozenset((*_TAGS, *_BYTES, "boolean"))


def json_of(message: Any) -> bytes:
    """The message in JSON.

    Raises:
        TypeError: a text that is no Unicode.

    """
    return orjson.dumps(_message(message, _json_array))


def cbor_of(message: Any) -> Any:
    """The message as a value for `cbor2`."""
    return _message(message, _cbor_array)


def _json_array(kind: str) -> Told:
    if kind in _BYTES:
        return lambda values: b2a_base64(bytes(values), newline=False).decode("ascii")
    return _listed


def _listed(values: Any) -> orjson.Fragment:
    # Not by a list, of which a map of millions of cells would make as many objects; and in parts,
    # for while orjson writes no other thread runs.
    numbers = np.asarray(values)
    parts = (
        orjson.dumps(numbers[start : start + _PART], option=orjson.OPT_SERIALIZE_NUMPY)[1:-1]
        for start in range(0, len(numbers), _PART)
    )
    return orjson.Fragment(b"[%b]" % b",".join(parts))


def _cbor_array(kind: str) -> Told:
    if kind in _BYTES:
        return bytes
    tag = _TAGS[kind]
    return lambda values: cbor2.CBORTag(tag, values.tobytes())


def _message(message: Any, numbers: Callable[[str], Told]) -> Any:
    kind: Any = type(message)
    return _members(kind, numbers)(message)


@cache
def _members(message_type: Any, numbers: Callable[[str], Told]) -> Told:
    """Makes a dict of a message; `numbers` tells how arrays of numbers are written."""
    kinds = message_type.get_fields_and_field_types()
    telling = [(name, _telling(kind, numbers)) for name, kind in kinds.items()]

    def tell(message: Any) -> dict[str, Any]:
        return {name: told(getattr(message, name)) for name, told in telling}

    return tell


def _telling(kind: str, numbers: Callable[[str], Told]) -> Told:
    found = _ARRAY.fullmatch(kind)
    if found is None:
        return _one(kind, numbers)
    of = found["kind"] or found["of"]
    if of in _TAGS or of in _BYTES:
        return numbers(of)
    one = _one(of, numbers)
    return lambda values: [one(value) for value in values]


def _one(kind: str, numbers: Callable[[str], Told]) -> Told:
    if kind in _PLAIN or kind.startswith(("string", "wstring")):
        return lambda value: value
    if kind == "octet":
        return lambda value: int.from_bytes(value, "little")
    return lambda message: _message(message, numbers)
