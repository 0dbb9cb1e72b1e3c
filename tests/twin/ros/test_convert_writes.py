"""What was written crosses as values for robots, and as rows for who copies the log."""

from __future__ import annotations

import math
from typing import Any

import pytest
from lupin_msgs.srv import GetWrites
from rclpy.serialization import deserialize_message, serialize_message

from lupin_twin.core.writes import DEFAULT_WRITES, PastWrite, PastWrites, RunSpan, WritesRequest
from lupin_twin.journal.follow import Lot, NotALotError
from lupin_twin.ros.convert_past import (
    lot_of,
    rows_request_message,
    rows_response,
    writes_request,
    writes_response,
)

WRITES = (
    PastWrite(4, 1, "7", 10, 0, 0, ("co2", "light"), (420.5, math.inf)),
    PastWrite(6, 1, "7", 11, 1, 0, has_seen=True, species="tulip", anomaly=True, bug_count=3),
    PastWrite(7, 2, "ä", 9, 0, 2),
)
PAST = PastWrites("a-1", (RunSpan(1, 0, 9), RunSpan(2, 9, 2**63 - 1)), WRITES, 9, is_all=True)
LOT = Lot("0123456789abcdef" * 2, ('["run",1,0,1,1,1,null,null]', '["meta","ä","5"]'), 9, True)


def over_the_wire(message: Any) -> Any:
    return deserialize_message(serialize_message(message), type(message))


def test_what_was_written_crosses_as_columns() -> None:
    response = over_the_wire(writes_response(PAST))
    assert (response.ok, response.journal, response.last, response.is_all) == (True, "a-1", 9, True)
    assert list(response.numbers) == [4, 6, 7]
    assert [response.texts[place] for place in response.tags] == ["7", "7", "ä"]
    assert [response.texts[place] for place in response.sensors] == ["co2", "light"]
    assert list(response.values) == [420.5, math.inf]
    assert list(response.reading_counts) == [2, 0, 0]
    assert (list(response.span_runs), list(response.span_starts_ns)) == ([1, 2], [0, 9])
    assert (response.has_seen[1], response.bug_counts[1]) == (True, 3)


def test_a_question_is_read_with_its_defaults() -> None:
    message = over_the_wire(GetWrites.Request(after=3))
    assert writes_request(message) == WritesRequest(after=3, max_count=DEFAULT_WRITES)


def test_rows_survive_the_wire() -> None:
    request = over_the_wire(rows_request_message(8))
    assert (request.after, request.as_rows) == (8, True)
    assert lot_of(over_the_wire(rows_response(LOT)), 8) == LOT


@pytest.mark.parametrize(
    "lot",
    [
        LOT._replace(last=7),
        LOT._replace(last=8, is_all=False),
        LOT._replace(journal="../../home"),
        LOT._replace(journal=""),
        LOT._replace(rows=("[]",) * 50_001),
    ],
)
def test_what_leads_nowhere_or_names_no_journal_is_no_lot(lot: Lot) -> None:
    with pytest.raises(NotALotError):
        lot_of(rows_response(lot), 8)
