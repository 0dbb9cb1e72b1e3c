from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest

from lupin_twin.convert_past import (
    NotAnAnswerError,
    writes_of,
    writes_request,
    writes_request_message,
    writes_response,
)
from lupin_twin.past_writes import DEFAULT_WRITES, PastWrite, PastWrites, RunSpan, WritesRequest
from tests.support.elsewhere import over_the_wire

ASKED = WritesRequest(after=3, max_count=10)
WRITES = (
    PastWrite(4, 1, "7", 10, 0, 0, ("co2", "light"), (420.5, math.inf)),
    PastWrite(6, 1, "7", 11, 1, 0, has_seen=True, species="tulip", anomaly=True, bug_count=3),
    PastWrite(7, 2, "ä", 9, 0, 2),
)
PAST = PastWrites("a-1", (RunSpan(1, 0, 9), RunSpan(2, 9, 2**63 - 1)), WRITES, 9, is_all=True)


def test_a_question_and_an_answer_come_over_the_wire_as_they_are() -> None:
    assert writes_request(over_the_wire(writes_request_message(ASKED))) == ASKED
    assert writes_of(over_the_wire(writes_response(PAST)), ASKED) == PAST


def test_of_no_count_the_default_is_meant() -> None:
    message = writes_request_message(ASKED)
    message.max_count = 0
    assert writes_request(message).max_count == DEFAULT_WRITES


def set_to(name: str, value: Any) -> Callable[[Any], None]:
    return lambda response: setattr(response, name, value)


@pytest.mark.parametrize(
    "spoil",
    [
        set_to("tags", [0]),
        set_to("tags", [0, 99, 0]),
        set_to("values", [1.0]),
        set_to("reading_counts", [1, 0, 0]),
        set_to("reading_counts", [65, 0, 0]),
        set_to("numbers", [3, 6, 7]),
        set_to("numbers", [4, 4, 7]),
        set_to("last", 6),
        set_to("span_runs", [1]),
    ],
)
def test_what_does_not_fit_is_no_answer(spoil: Callable[[Any], None]) -> None:
    response = writes_response(PAST)
    spoil(response)
    with pytest.raises(NotAnAnswerError):
        writes_of(response, ASKED)


def test_more_than_was_asked_for_and_nothing_for_ever_is_no_answer() -> None:
    with pytest.raises(NotAnAnswerError, match="3 writes, asked for were 2"):
        writes_of(writes_response(PAST), WritesRequest(after=3, max_count=2))
    empty = writes_response(PastWrites("a", (), (), 3, is_all=False))
    with pytest.raises(NotAnAnswerError, match="not all"):
        writes_of(empty, ASKED)
