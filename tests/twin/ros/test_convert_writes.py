"""What was written crosses as values for robots, and as rows for who copies the log."""

from __future__ import annotations

import math
from typing import Any

import pytest
from rclpy.serialization import deserialize_message, serialize_message

from lupin_twin.core.writes import PastWrite, PastWrites, RunSpan
from lupin_twin.journal.follow import Lot, NotALotError
from lupin_twin.ros.convert_past import (
    lot_of,
    rows_request_message,
    rows_response,
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
