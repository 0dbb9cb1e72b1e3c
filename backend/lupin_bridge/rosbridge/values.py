"""ROS messages as rosbridge tells them, in JSON. Pure.

What a message has is read off its own `get_fields_and_field_types`, once for each type. Arrays of
bytes (uint8, char) are base64, all others lists; no finite number: null. A time is
`{sec, nanosec}`, as any other message.
"""

from __future__ import annotations

import re
from binascii import b2a_base64
from collections.abc import Callable
from functools import cache
from typing import Any, Final

import numpy as np
import orjson

Told = Callable[[Any], Any]

_ARRAY: Final = re.compile(r"sequence<(?P<kind>[\w/]+)(?:, \d+)?>|(?P<of>[\w/]+)\[\d+\]")
_BYTES: Final = frozenset(("uint8", "char"))
_NUMBERS: Final = frozenset(
    ("uint16", "uint32", "uint64", "int8", "int16", "int32", "int64", "float", "double")
)
# Numbers that are written as JSON in one go: a millisecond's worth.
_PART: Final = 65_536
_PLAIN: Final = _NUMBERS | _BYTES | {"boolean"}


def json_of(message: Any) -> bytes:
    """The message in JSON.

    Raises:
        TypeError: a text that is no Unicode.

    """
    return orjson.dumps(_message(message))


def _base64(values: Any) -> str:
    return b2a_base64(bytes(values), newline=False).decode("ascii")


def _listed(values: Any) -> orjson.Fragment:
    # Not by a list, of which a map of millions of cells would make as many objects; and in parts,
    # for while orjson writes no other thread runs.
    numbers = np.asarray(values)
    parts = (
        orjson.dumps(numbers[start : start + _PART], option=orjson.OPT_SERIALIZE_NUMPY)[1:-1]
        for start in range(0, len(numbers), _PART)
    )
    return orjson.Fragment(b"[%b]" % b",".join(parts))


def _message(message: Any) -> Any:
    kind: Any = type(message)
    return _members(kind)(message)


@cache
def _members(message_type: Any) -> Told:
    """Makes a dict of a message."""
    kinds = message_type.get_fields_and_field_types()
    telling = [(name, _telling(kind)) for name, kind in kinds.items()]

    def tell(message: Any) -> dict[str, Any]:
        return {name: told(getattr(message, name)) for name, told in telling}

    return tell


def _telling(kind: str) -> Told:
    found = _ARRAY.fullmatch(kind)
    if found is None:
        return _one(kind)
    of = found["kind"] or found["of"]
    if of in _BYTES:
        return _base64
    if of in _NUMBERS:
        return _listed
    one = _one(of)
    return lambda values: [one(value) for value in values]


def _one(kind: str) -> Told:
    if kind in _PLAIN or kind.startswith(("string", "wstring")):
        return lambda value: value
    if kind == "octet":
        return lambda value: int.from_bytes(value, "little")
    return _message
