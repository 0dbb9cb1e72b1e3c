from lupin_twin.core.diagnostics import ERROR, OK, Finding
from lupin_twin.ros.convert import diagnostics, findings_of

MESSAGE = [
    Finding("clock", OK, "it runs", {"state": "running"}),
    Finding("drops", ERROR, "", {}),
    Finding("twins", OK, "", {"state topic": "/gh1/twin/state"}),
]
S = 1_000_000_000


def test_findings_become_statuses_of_their_node_and_back() -> None:
    msg = diagnostics(MESSAGE, "/gh1/lupin_twin", 7 * S)
    assert msg.header.stamp.sec == 7
    assert [status.name for status in msg.status] == [
        "/gh1/lupin_twin: clock",
        "/gh1/lupin_twin: drops",
        "/gh1/lupin_twin: twins",
    ]
    assert list(findings_of(msg, "/gh1/twin/state")) == MESSAGE


def test_a_twin_is_identified_by_the_state_that_it_publishes() -> None:
    msg = diagnostics(MESSAGE, "/gh1/lupin_twin", 7 * S)
    others = diagnostics(MESSAGE[:2], "/gh2/lupin_twin", 7 * S).status
    msg.status = [*others, *msg.status, *others]
    assert list(findings_of(msg, "/gh1/twin/state")) == MESSAGE
    assert not list(findings_of(msg, "/gh2/twin/state"))
