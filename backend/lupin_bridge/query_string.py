"""A query string, read by the dataclass of its parameters, which also describes it to OpenAPI.

pydantic reads, and is imported as it does: what looks back knows queries, and has no use for it.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import MISSING, field, fields
from functools import cache
from typing import Annotated, Any, Final, TypeVar

from annotated_types import Len

from lupin_twin.core.drops import MAX_TEXT_LENGTH
from lupin_twin.core.past import PastRefused

QueryT = TypeVar("QueryT")
MOMENT: Final = "ROS seconds as a decimal number, or ISO 8601 with an offset"
AT: Final = f"as of this moment: {MOMENT}; default: now"
_UNSAFE_IN_NAME: Final = re.compile(r"[^A-Za-z0-9._-]")
# A tag's, or a sensor's.
Name = Annotated[str, Len(1, MAX_TEXT_LENGTH)]


def parameter(description: str, default: Any = None) -> Any:
    """A field of a query, for people; a keyword's own name has an underscore behind it."""
    return field(default=default, metadata={"description": description})


def needed(description: str) -> Any:
    """One that has to be given."""
    return field(metadata={"description": description})


def read(kind: type[QueryT], given: Sequence[tuple[str, str]]) -> QueryT:
    """A query string's (name, value) pairs as a query.

    A query is refused, never guessed at: an unknown or repeated parameter is a typing error that
    would otherwise go unseen.

    Raises:
        PastRefused: an unknown or repeated parameter, or a value that cannot be.

    """
    from pydantic import ValidationError  # noqa: PLC0415  # see above

    names = {spec.name.rstrip("_"): spec.name for spec in fields(kind)}  # type: ignore[arg-type]
    values: dict[str, str] = {}
    for name, value in given:
        if name not in names:
            raise PastRefused(f"parameter {name[:64]!r} is unknown, expected {', '.join(names)}")
        if names[name] in values:
            raise PastRefused(f"{name} is given more than once, expected one value")
        values[names[name]] = value
    try:
        query: QueryT = _adapter(kind).validate_python(values)  # type: ignore[arg-type]  # hashable
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        name, why = str(first["loc"][0]).rstrip("_"), first["msg"]
        shown = f" is {first['input'][:64]!r}" if isinstance(first["input"], str) else ""
        raise PastRefused(f"{name}{shown}: {why[0].lower()}{why[1:]}") from None
    return query


def parameters_of(kind: type[Any]) -> list[dict[str, Any]]:
    """A query's parameters as OpenAPI has them."""
    described = _adapter(kind).json_schema()["properties"]  # type: ignore[arg-type]  # as above
    return [
        {
            "name": spec.name.rstrip("_"),
            "in": "query",
            "required": spec.default is MISSING,
            "schema": _plain(described[spec.name]),
            "description": spec.metadata["description"],
        }
        for spec in fields(kind)
    ]


def safe_name(text: str) -> str:
    """A file's name of it: what a file system or a shell could take amiss becomes an underscore."""
    return _UNSAFE_IN_NAME.sub("_", text)


def _plain(schema: dict[str, Any]) -> dict[str, Any]:
    """Without null: in a query string, what is not given is left out."""
    kinds = schema.get("anyOf", [schema])
    plain = next(kind for kind in kinds if kind.get("type") != "null")
    if schema.get("default") is not None:
        plain = {**plain, "default": schema["default"]}
    return {name: value for name, value in plain.items() if name not in ("title", "description")}


@cache
def _adapter(kind: type[Any]) -> Any:
    from pydantic import TypeAdapter  # noqa: PLC0415  # as above

    return TypeAdapter(kind)
