"""The definition of a message type, with all that it is made of, as bags and viewers want it.

From the `.msg` files that every message package installs, wherever ROS is installed. The form is
that of the schema encoding `ros2msg` (https://mcap.dev/spec/registry#ros2msg).
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Final

ENCODING: Final = "ros2msg"
_RULE: Final = "=" * 80
_NAME: Final = re.compile(r"([A-Za-z]\w*)/msg/([A-Za-z]\w*)", re.ASCII)
# A field, or a constant: its type without bounds and array, `pkg/Name` or `Name`.
_LINE: Final = re.compile(r"\s*([A-Za-z]\w*(?:/[A-Za-z]\w*){0,2})", re.ASCII)
# https://docs.ros.org/en/jazzy/Concepts/Basic/About-Interfaces.html#field-types
_PRIMITIVES: Final = frozenset(
    (
        *("bool", "byte", "char", "float32", "float64", "string", "wstring"),
        *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)),
    )
)


def schema_text(type_name: str, environ: Mapping[str, str] = os.environ) -> str:
    """The text of `package/msg/Name` and, each once, of all types that it is made of.

    Looked for as ROS does: in the prefixes of AMENT_PREFIX_PATH, then in Python's own, where the
    wheels of ROS put it.

    Raises:
        LookupError: it, or a type that it is made of, is not installed, or it is no such name.

    """
    prefixes = [prefix for prefix in environ.get("AMENT_PREFIX_PATH", "").split(":") if prefix]
    return _schema_text(type_name, (*prefixes, sys.prefix))


@cache
def _schema_text(type_name: str, prefixes: tuple[str, ...]) -> str:
    texts: dict[str, str] = {}
    wanted = [(type_name, "")]
    while wanted:
        name, needed_by = wanted.pop(0)
        if name not in texts:
            texts[name] = _definition(name, needed_by, prefixes)
            wanted += [(part, f", a part of {name},") for part in _parts(texts[name], name)]
    own, *others = texts
    # A part is known by `package/Name` there, without the `msg`.
    return "\n".join(
        (
            texts[own],
            *(f"{_RULE}\nMSG: {name.replace('/msg/', '/')}\n{texts[name]}" for name in others),
        )
    )


def _definition(type_name: str, needed_by: str, prefixes: tuple[str, ...]) -> str:
    parts = _NAME.fullmatch(type_name)
    if parts is None:
        raise LookupError(f"{type_name!r} is no message type, must be package/msg/Name")
    package, name = parts.groups()
    for prefix in prefixes:
        try:
            return Path(prefix, "share", package, "msg", f"{name}.msg").read_text(encoding="utf-8")
        except (FileNotFoundError, NotADirectoryError):
            continue
    raise LookupError(
        f"the message type {type_name}{needed_by} is not installed: there is no "
        f"share/{package}/msg/{name}.msg in {', '.join(prefixes)}"
    )


def _parts(text: str, type_name: str) -> list[str]:
    """The message types that the fields of a definition have, in their order."""
    package = type_name.partition("/")[0]
    found = []
    for line in text.splitlines():
        field = _LINE.match(line)
        if field is None or field[1] in _PRIMITIVES:
            continue
        words = field[1].split("/")
        found.append(f"{words[0] if len(words) > 1 else package}/msg/{words[-1]}")
    return found
