"""Query strings, parsed by a dataclass, and the same values in OpenAPI."""

from contextlib import suppress
from dataclasses import dataclass
from typing import Annotated, Literal

import pytest
from annotated_types import Interval
from hypothesis import given
from hypothesis import strategies as st

from lupin_bridge.query_string import Name, needed, parameter, read
from lupin_bridge.routes.state import ListenQuery
from lupin_twin.core.past import PastRefused


@dataclass(frozen=True, slots=True)
class Some:
    a: Name = needed("one")
    from_: Annotated[int, Interval(ge=1, le=5)] = parameter("another", 2)
    c: Literal["x", "y"] | None = parameter("a third")


def refusal(*pairs: tuple[str, str]) -> str:
    with pytest.raises(PastRefused) as refused:
        read(Some, pairs)
    return str(refused.value)


@pytest.mark.parametrize(
    ("parameters", "why"),
    [
        ([("d", "1")], "parameter 'd' is unknown, expected a, from, c"),
        ([("from_", "1")], "parameter 'from_' is unknown, expected a, from, c"),
        ([("x" * 65, "1")], f"parameter '{'x' * 64}' is unknown, expected a, from, c"),
        ([("a", "1"), ("a", "1")], "a is given more than once, expected one value"),
        ([], "a: field required"),
        ([("a", "")], "a is '': string should have at least 1 character"),
        ([("a", "1"), ("from", "6")], "from is '6': input should be less than or equal to 5"),
        ([("a", "1"), ("from", "two")], "from is 'two': input should be a valid integer"),
        ([("a", "1"), ("from", "9" * 5_000)], f"from is '{'9' * 64}': "),
        ([("a", "1\0")], "a is '1\\x00', which has a NUL character"),
        ([("a", "1"), ("c", "z")], "c is 'z': input should be 'x' or 'y'"),
    ],
)
def test_an_invalid_value_is_refused_by_name_in_the_callers_way(
    parameters: list[tuple[str, str]], why: str
) -> None:
    assert refusal(*parameters).startswith(why)


@given(st.lists(st.tuples(st.sampled_from(["a", "from", "c"]) | st.text(), st.text()), max_size=3))
def test_any_query_string_is_parsed_or_refused(pairs: list[tuple[str, str]]) -> None:
    with suppress(PastRefused):
        read(Some, pairs)


# --- options of a WebSocket client ----------------------------------------------------------------


def test_the_lowest_rate_is_one_and_anything_lower_is_refused() -> None:
    requested = read(ListenQuery, [("delta", "1"), ("max_rate_hz", "0.01")])
    assert (requested.delta, requested.min_interval_s) == (True, 100.0)
    for value in ("0.0099", "0", "-1", "nan", "fast", ""):
        with pytest.raises(ValueError, match=f"max_rate_hz is '{value}': input should be"):
            read(ListenQuery, [("max_rate_hz", value)])
