"""What a WebSocket client may ask for, without a server."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lupin_bridge.routes.state import MIN_RATE_HZ, ListenQuery, ListenRefused, listen_query

MAX_REASON_BYTES = 123  # RFC 6455, section 5.5, less the two of the code


def test_who_asks_for_nothing_gets_every_state_whole() -> None:
    assert listen_query([]) == ListenQuery(delta=False, max_rate_hz=math.inf)
    assert listen_query([]).min_interval_s == 0.0


def test_a_full_query() -> None:
    query = listen_query([("delta", "1"), ("max_rate_hz", "0.5")])
    assert query == ListenQuery(delta=True, max_rate_hz=0.5)
    assert query.min_interval_s == 2.0


@pytest.mark.parametrize(
    ("query", "named"),
    [
        ([("rate", "1")], ["'rate' is unknown", "expected delta or max_rate_hz"]),
        ([("delta", "1"), ("delta", "1")], ["delta is given more than once"]),
        ([("delta", "yes")], ["delta is 'yes'", "0 or 1"]),
        ([("delta", "")], ["delta is ''", "0 or 1"]),
        ([("encoding", "cbor")], ["'encoding' is unknown", "expected delta or max_rate_hz"]),
        ([("max_rate_hz", "0")], ["max_rate_hz is '0'", "from 0.01"]),
        ([("max_rate_hz", "-1")], ["max_rate_hz is '-1'", "from 0.01"]),
        ([("max_rate_hz", "nan")], ["max_rate_hz is 'nan'", "from 0.01"]),
        ([("max_rate_hz", "fast")], ["max_rate_hz is 'fast'", "a number"]),
        ([("max_rate_hz", "1_0")], ["max_rate_hz is '1_0'", "a number"]),
        ([("max_rate_hz", "\u0661")], ["max_rate_hz is", "a number"]),
        ([("max_rate_hz", "0.0099")], ["from 0.01"]),
    ],
)
def test_what_cannot_be_served_is_named(query: list[tuple[str, str]], named: list[str]) -> None:
    with pytest.raises(ListenRefused) as refused:
        listen_query(query)
    for words in named:
        assert words in str(refused.value)


@given(
    st.lists(
        st.tuples(
            st.sampled_from(["delta", "max_rate_hz"]) | st.text(max_size=200),
            st.text(max_size=200),
        ),
        max_size=3,
    )
)
def test_every_refusal_fits_into_a_close_frame(query: list[tuple[str, str]]) -> None:
    reason = ""
    try:
        listen_query(query)
    except ListenRefused as refused:
        reason = str(refused)
    assert len(reason.encode()) <= MAX_REASON_BYTES


def test_the_lowest_rate_is_one_and_anything_lower_is_not() -> None:
    assert listen_query([("max_rate_hz", "0.01")]).max_rate_hz == MIN_RATE_HZ
    with pytest.raises(
        ListenRefused, match=r"max_rate_hz is '0.00999', expected a number from 0.01"
    ):
        listen_query([("max_rate_hz", "0.00999")])
