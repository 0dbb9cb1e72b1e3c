"""A query string's values by their names. Pure; the commands read it before numpy is there."""

from __future__ import annotations

from collections.abc import Sequence


def values_of(
    parameters: Sequence[tuple[str, str]], names: Sequence[str], refused: type[Exception]
) -> dict[str, str]:
    """A query's values by their names.

    Raises:
        Exception: `refused`: an unknown or repeated parameter.

    """
    values: dict[str, str] = {}
    for name, value in parameters:
        if name not in names:
            raise refused(f"parameter {name[:64]!r} is unknown, expected {', '.join(names)}")
        if name in values:
            raise refused(f"{name} is given more than once, expected one value")
        values[name] = value
    return values
