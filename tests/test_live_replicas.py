"""Two bridges, one twin: the same answers from both."""

from collections.abc import Iterator
from contextlib import ExitStack
from functools import partial
from typing import Any

import pytest
from lupin_msgs.msg import TwinState, TwinTagState

from tests.support.domains import own_domain
from tests.support.live import attached, field_of, wait_until_ready
from tests.support.messages import inspection, occupancy_grid, scan
from tests.support.processes import OFTEN, lupin_twin, twin_node
from tests.support.ros import Peer
from tests.support.waiting import wait_for
from tests.support.web import Bridge, without_ages

FIELD: dict[str, Any] = {"sensor_type": "co2", "resolution": 0.25}
CACHED = ("/api/field.json", "/api/field.npy", "/api/field.png")


@pytest.fixture
def replicas() -> Iterator[tuple[Bridge, Bridge]]:
    """Two `lupin-twin web` processes; the second starts after the twin's first observations."""
    with ExitStack() as stack:
        domain = stack.enter_context(own_domain())
        stack.enter_context(twin_node(domain, *OFTEN))
        peer = stack.enter_context(Peer(domain))

        def replica() -> Bridge:
            process = stack.enter_context(lupin_twin(domain, "web", afresh=True))
            running = stack.enter_context(attached(process, peer))
            wait_until_ready(running)
            return running

        first = replica()
        # The second never receives the first of these maps, nor the first reading of "a".
        peer.publish_map(occupancy_grid([[0, 0], [0, 100]]))
        peer.observe(scan("a", {"co2": 400.0}, (0, 0)))
        first.tag("a")
        wait_for(lambda: first.get("/api/map").status_code == 200, "the map")
        peer.publish_map(occupancy_grid([[0, -1], [0, 100]]))
        peer.observe(
            scan("a", {"co2": 500.0}),
            scan("b", {"co2": 700.0, "humidity": float("nan")}, (1, 0)),
            inspection("a", "lupin", blooms=[(0.1, 0.1)], footprint=[(0, 0), (1, 0), (1, 1)]),
        )
        second = replica()
        for running in (first, second):
            running.tag("b")
            running.tag("a", lambda tag: tag["flowers"])
        wait_for(lambda: pictures_agree(first, second), "the latest map at both")
        yield first, second


def pictures_agree(first: Bridge, second: Bridge) -> bool:
    """Whether both have the same map, which the second can only have from the latest one."""
    ours, theirs = first.get("/api/map.png"), second.get("/api/map.png")
    return theirs.status_code == 200 and ours.content == theirs.content


def is_recording(running: Bridge) -> bool:
    return bool(running.json("/readyz")["journal"]["state"] == "recording")


def test_both_serve_the_same(replicas: tuple[Bridge, Bridge]) -> None:
    first, second = replicas
    for running in replicas:
        # The twin reports its journal's state once a second, in /diagnostics.
        wait_for(partial(is_recording, running), "the journal's state")
        field_of(running, **FIELD)
    # A state's times come after it.
    wait_for(
        lambda: without_ages(first.json("/api/state")) == without_ages(second.json("/api/state")),
        "the same state of both",
    )
    assert first.json("/api/map") == second.json("/api/map")
    for path in CACHED:
        ours, theirs = first.get(path, **FIELD), second.get(path, **FIELD)
        assert ours.status_code == theirs.status_code == 200
        assert ours.content == theirs.content
    assert first.json("/api/field", **FIELD)["sample_count"] == 2

    # Behind a load balancer, an ETag of one replica holds at the other.
    for path, query in [
        *((path, FIELD) for path in CACHED),
        ("/api/map", {}),
        ("/api/map.png", {}),
    ]:
        etag = first.get(path, **query).headers["etag"]
        again = second.get(path, headers={"If-None-Match": etag}, **query)
        assert (again.status_code, again.headers["etag"]) == (304, etag)


def test_a_twin_without_times_has_no_history_and_no_times_of_readings(domain: int) -> None:
    """One of another build, which publishes its state alone."""
    message = TwinState(tags=[TwinTagState(tag_id="1")])
    message.header.frame_id = "map"
    message.header.stamp.sec = 100
    with (
        Peer(domain) as peer,
        lupin_twin(domain, "web", "--port", "0") as process,
        attached(process, peer) as live,
    ):
        peer.publish("/twin/state", message, depth=1)
        wait_for(lambda: live.get("/api/tags/1").status_code == 200, "the state")
        answer = live.get("/api/tags/1/history")
        assert (answer.status_code, "journal is not known" in answer.text) == (503, True)
        tag = live.json("/api/tags/1")
        assert (tag["last_try"], tag["last_try_status"]) == (None, None)
        assert "looked_at" not in tag
