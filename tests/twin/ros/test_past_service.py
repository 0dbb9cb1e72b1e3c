"""The services of the past, over DDS, of a twin without a journal."""

from collections.abc import Iterator

import pytest
from builtin_interfaces.msg import Time
from lupin_msgs.srv import GetHistory, GetStateAt

from lupin_twin.core.interfaces import GET_HISTORY
from tests.support import messages
from tests.support.domains import own_domain
from tests.support.processes import OFTEN, twin_node
from tests.support.ros import Peer
from tests.support.waiting import wait_for


@pytest.fixture(scope="module")
def peer() -> Iterator[Peer]:
    with (
        own_domain() as domain,
        twin_node(domain, *OFTEN, "-p", "journal:=off"),
        Peer(domain) as peer,
    ):
        peer.wait_for_twin()
        for second in (10.0, 20.5, 30.0):
            peer.observe(messages.scan("a", {"co2": 400.0 + second}, stamp_s=second))
        peer.observe(messages.scan("a", status=2, stamp_s=40.0))
        peer.observe(messages.scan("last", {"co2": 1.0}))
        peer.tag("last")
        # What is shown is in the log within 100 ms.
        wait_for(
            lambda: peer.ask(GetHistory, GET_HISTORY.name, tag_id="last", sensor_type="co2").stamps,
            "the last scan in the log",
        )
        yield peer


def test_a_state_of_then_is_known_without_a_journal_too(peer: Peer) -> None:
    response = peer.ask(GetStateAt, "/twin/get_state_at", at=Time(sec=15))
    assert response.ok, response.error_message
    [tag] = response.state.tags
    assert (tag.tag_id, tag.readings[0].value) == ("a", 410.0)


def test_what_cannot_be_answered_is_refused_by_name_and_empty(peer: Peer) -> None:
    later = peer.ask(GetStateAt, "/twin/get_state_at", at=Time(sec=2**31 - 1))
    assert "at is 2147483647.000000000 s, later than now, 1" in later.error_message
    assert later == GetStateAt.Response(error_message=later.error_message)
    nameless = peer.ask(GetHistory, "/twin/get_history", sensor_type="co2")
    assert nameless == GetHistory.Response(error_message="tag_id is empty")
    many = peer.ask(GetHistory, "/twin/get_history", tag_id="a", sensor_type="co2", max_points=5001)
    assert many.error_message == "max_points is 5001, the limits are 1 and 5000"
