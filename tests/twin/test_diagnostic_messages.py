from __future__ import annotations

from lupin_twin.diagnostic_messages import diagnostics, findings_of
from lupin_twin.diagnostics import ERROR, OK, Finding

SAID = [Finding("clock", OK, "it runs", {"state": "running"}), Finding("drops", ERROR, "", {})]
S = 1_000_000_000


def test_findings_become_statuses_of_their_node_and_back() -> None:
    msg = diagnostics(SAID, "/gh1/lupin_twin", 7 * S)
    assert msg.header.stamp.sec == 7
    assert [status.name for status in msg.status] == [
        "/gh1/lupin_twin: clock",
        "/gh1/lupin_twin: drops",
    ]
    assert list(findings_of(msg, "/gh1/lupin_twin")) == SAID


def test_what_another_node_says_is_not_taken_for_it() -> None:
    msg = diagnostics(SAID, "/gh1/lupin_twin", 7 * S)
    assert not list(findings_of(msg, "/gh2/lupin_twin"))
    assert not list(findings_of(msg, "/gh1/lupin"))
    msg.status[0].hardware_id = "a board"
    msg.status[1].name = "drops"
    assert not list(findings_of(msg, "/gh1/lupin_twin"))
