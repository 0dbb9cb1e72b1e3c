"""The values of a query string."""

from __future__ import annotations

import pytest

from lupin_bridge.query_string import values_of


class Refused(Exception):
    pass


def test_each_name_has_its_value() -> None:
    assert values_of([("b", "2"), ("a", "")], ("a", "b", "c"), Refused) == {"a": "", "b": "2"}


@pytest.mark.parametrize(
    ("parameters", "why"),
    [
        ([("d", "1")], "parameter 'd' is unknown, expected a, b"),
        ([("x" * 65, "1")], f"parameter '{'x' * 64}' is unknown, expected a, b"),
        ([("a", "1"), ("a", "1")], "a is given more than once, expected one value"),
    ],
)
def test_what_is_unknown_or_repeated_is_refused_in_the_callers_way(
    parameters: list[tuple[str, str]], why: str
) -> None:
    with pytest.raises(Refused) as refused:
        values_of(parameters, ("a", "b"), Refused)
    assert str(refused.value) == why
