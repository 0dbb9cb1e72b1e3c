"""GetEstimate over DDS: refusals, and a flood; `routes/test_estimate` has the answers."""

from collections.abc import Iterator
from typing import Any

import pytest
from builtin_interfaces.msg import Time
from lupin_msgs.srv import GetEstimate, GetEstimateReport

from lupin_twin.runtime.workers import MAX_QUERIES
from tests.support import messages
from tests.support.domains import own_domain
from tests.support.journal import select
from tests.support.processes import OFTEN, twin_node
from tests.support.ros import Peer
from tests.support.waiting import wait_for

SERVICE = "/twin/get_estimate"
REPORT_SERVICE = "/twin/get_estimate_report"
BOX: dict[str, Any] = {
    "sensor_type": "temperature",
    "resolution": 0.5,
    "bbox_min_x": 0.0,
    "bbox_min_y": 0.0,
    "bbox_max_x": 2.0,
    "bbox_max_y": 3.0,
}


@pytest.fixture(scope="module")
def peer(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Peer]:
    journal = tmp_path_factory.mktemp("journal") / "j.sqlite"
    arguments = (*OFTEN, "-p", f"journal:={journal}")
    with own_domain() as domain, twin_node(domain, *arguments), Peer(domain) as peer:
        peer.wait_for_twin()
        peer.observe(
            messages.scan("a", {"temperature": 21.0}, at=(0.25, 0.25)),
            messages.scan("b", {"temperature": 25.0}, at=(1.75, 2.75)),
        )
        rows = "SELECT count(*) FROM scan"
        wait_for(lambda: select(journal, rows) == [(2,)], "both in the journal")
        yield peer


def request(peer: Peer, **changes: Any) -> Any:
    return peer.call(GetEstimate, SERVICE, **{**BOX, **changes})


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"sensor_type": ""}, "sensor_type is empty"),
        ({"resolution": 0.0}, "resolution is 0.0"),
        ({"resolution": 0.0001}, "cells"),
        ({"sensor_type": "ph"}, "no tag has a reading of this sensor_type in the 86400 s"),
        ({"at": Time(sec=2**31 - 1)}, "at is 2147483647.000000000 s, later than now"),
    ],
)
def test_an_impossible_estimate_is_refused_by_name(
    peer: Peer, changes: dict[str, Any], complaint: str
) -> None:
    answer = request(peer, **changes)
    assert complaint in answer.error_message
    assert answer == GetEstimate.Response(error_message=answer.error_message)


def test_a_flood_of_expensive_requests_delays_no_observation_and_no_field(peer: Peer) -> None:
    dearest = {**BOX, "resolution": 0.003}
    clients = [
        peer.node.create_client(kind, name)
        for kind, name in ((GetEstimate, SERVICE), (GetEstimateReport, REPORT_SERVICE))
    ]
    for client in clients:
        peer.until(client.service_is_ready, "the service")
    requested: list[Any] = []

    def query_both() -> None:
        place = {**dearest, "bbox_max_x": 2.0 + len(requested) / 1000.0}
        requested.append(clients[0].call_async(GetEstimate.Request(**place)))
        requested.append(
            clients[1].call_async(GetEstimateReport.Request(sensor_type="temperature"))
        )

    for _ in range(MAX_QUERIES + 8):
        query_both()
        peer.spin_briefly()
    peer.observe(messages.scan("in the flood", {"co2": 400.0}, at=(1.0, 1.0)))
    peer.tag("in the flood")
    assert peer.get_field(**{**BOX, "sensor_type": "co2"}).sample_count == 1

    def answers(ok: bool) -> list[Any]:
        return [one.result() for one in requested if one.done() and one.result().ok is ok]

    def are_there() -> bool:
        # A service queues ten requests: DDS loses some of such a flood, and all but twenty for a
        # twin that stands still meanwhile, which are too few to be refused.
        if not answers(False):
            query_both()
        return bool(answers(True) and answers(False))

    peer.until(are_there, "an answer and a refusal")
    assert all(one.error_message.endswith("ask again later") for one in answers(False))
    for client in clients:
        peer.node.destroy_client(client)
