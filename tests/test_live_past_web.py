"""`web` looks back by its twin's services: what it says, and what when the twin ends meanwhile."""

from __future__ import annotations

import csv
import io
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from typing import Any

import pytest

from tests.support.domains import own_domain
from tests.support.journal import select
from tests.support.live import attached, field_of, wait_until_ready
from tests.support.messages import look, scan
from tests.support.processes import OFTEN, Process, limits, lupin_twin, twin_node
from tests.support.ros import Peer
from tests.support.waiting import PATIENCE_S, wait_for
from tests.support.web import Bridge, filled

# How long Fast DDS keeps a dead process in the graph.
DDS_LEASE_S = 20.0
T = 1_700_000_000.0
OBSERVED = 40
Both = tuple[Process, Bridge, Bridge]


@pytest.fixture(scope="module")
def both(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Both]:
    """A twin, two replicas of `web`, and an hour of observations long ago."""
    journal = tmp_path_factory.mktemp("journal") / "j.sqlite"
    with ExitStack() as stack:
        domain = stack.enter_context(own_domain())
        twin = stack.enter_context(twin_node(domain, *OFTEN, "-p", f"journal:={journal}"))
        peer = stack.enter_context(Peer(domain))
        peer.wait_for_twin()
        for number in range(OBSERVED):
            at_s = T + 60.0 * number
            peer.observe(scan("a", {"co2": 400.0 + number}, stamp_s=at_s, at=(1.0, 2.0)))
        peer.observe(
            look("a", anomaly=True, bug_count=2, stamp_s=T + 90.0),
            scan("b", status=2, stamp_s=T + 95.0),
        )
        peer.tag("b")
        replicas = []
        for _ in range(2):
            process = stack.enter_context(lupin_twin(domain, "web", *limits(answer_timeout_s=2)))
            replicas.append(stack.enter_context(attached(process, peer)))
        for replica in replicas:
            wait_until_ready(replica)
        rows = "SELECT count(*) FROM scan"
        wait_for(lambda: select(journal, rows) == [(OBSERVED + 1,)], "all of it in the journal")
        first, second = replicas
        yield twin, first, second


def asked(live: Bridge, path: str, **query: Any) -> Any:
    """The JSON, as soon as the twin's service was found."""

    def look_for() -> Any:
        response = live.get(path, **query)
        return response if response.status_code == 200 else None

    return wait_for(look_for, f"{path} {query}").json()


def test_a_moment_is_as_it_was_then_and_has_one_etag_in_every_replica(both: Both) -> None:
    _, first, second = both
    state = asked(first, "/api/state", at=T + 100.0)
    assert state["header"]["stamp"] == {"sec": int(T) + 100, "nanosec": 0}
    tags = {tag["tag_id"]: tag for tag in state["tags"]}
    [co2] = filled(tags["a"])["readings"]
    assert (co2["value"], co2["observed_at"]["sec"]) == (401.0, int(T) + 60)
    assert (tags["a"]["bug_count"], tags["a"]["anomaly"]) == (2, True)
    assert tags["b"]["last_try_status"] == 2
    asked(second, "/api/state", at=T + 100.0)
    etags = {live.get("/api/state", at=T + 100.0).headers["etag"] for live in (first, second)}
    assert len(etags) == 1
    response = second.get("/api/state", headers={"If-None-Match": etags.pop()}, at=T + 100.0)
    assert response.status_code == 304
    refused = first.get("/api/state", at=2**31 - 1)
    assert (refused.status_code, "later than now" in refused.text) == (400, True)


def test_an_estimate_of_then_is_the_same_in_every_replica(both: Both) -> None:
    _, first, second = both
    query: dict[str, Any] = {"sensor_type": "co2", "resolution": 0.5, "at": T + 600.0}
    one = asked(first, "/api/estimate", **query)
    assert (one["sample_count"], one["reading_count"]) == (1, 11)
    same = wait_for(  # a model may be fitted in between
        lambda: (
            len({live.get("/api/estimate", **query).headers["etag"] for live in (first, second)})
            == 1
        ),
        "one ETag",
    )
    assert same
    refused = first.get("/api/estimate", sensor_type="ph")
    assert (refused.status_code, refused.json()["ok"]) == (400, False)


def test_history_timeline_and_export_tell_the_same_past(both: Both) -> None:
    _, first, second = both
    query = {"tag_id": "a", "sensor_type": "co2"}
    history = asked(first, "/api/history", **query)
    values = [400.0 + number for number in range(OBSERVED)]
    assert [reading["value"] for reading in history["readings"]] == values
    assert history["from"] == {"sec": int(T), "nanosec": 0}
    buckets = asked(first, "/api/history", **query, points=10, to=T + 60.0 * OBSERVED)
    assert (buckets["bucket_s"], buckets["from"]["sec"]) == (240.0, int(T))
    assert sum(bucket["n"] for bucket in buckets["buckets"]) == OBSERVED
    assert buckets == asked(second, "/api/history", **query, points=10, to=T + 60.0 * OBSERVED)

    timeline = asked(first, "/api/timeline", to=T + 60.0 * OBSERVED)
    counted = {
        name: sum(bucket[name] for bucket in timeline["buckets"])
        for name in ("scans", "failures", "looks", "pests_seen")
    }
    assert counted == {"scans": OBSERVED, "failures": 1, "looks": 1, "pests_seen": 1}
    assert timeline["reach"]["from"]["sec"] == int(T)

    response = first.get("/api/export.csv", to=T + 60.0 * OBSERVED)
    rows = list(csv.DictReader(io.StringIO(response.text)))
    assert [float(row["value"]) for row in rows if row["tag_id"] == "a"] == values
    assert {(row["x_m"], row["y_m"]) for row in rows if row["tag_id"] == "a"} == {("1.0", "2.0")}
    assert [(row["status"], row["sensor"]) for row in rows if row["tag_id"] == "b"] == [("2", "")]


def test_a_twin_that_is_killed_while_it_is_asked_is_told_of_and_nobody_waits(both: Both) -> None:
    """Last: it ends the twin."""
    twin, first, _ = both
    twin.freeze()
    with ThreadPoolExecutor(4) as pool:
        answers = [
            pool.submit(first.get, "/api/history", tag_id="a", sensor_type="co2", points=n)
            for n in (11, 12)
        ]
        answers.append(pool.submit(first.get, "/api/state", at=T + 1.0))
        answers.append(pool.submit(first.get, "/api/export.csv", to=T + 7.0))
        twin.kill()
        statuses = {answer.result().status_code for answer in answers}
    assert statuses <= {503, 504}  # not there, or no answer in time
    assert first.get("/healthz").status_code == 200


def test_a_killed_twin_is_asked_nothing_and_who_asked_it_before_is_told(domain: int) -> None:
    """DDS takes twenty seconds to miss it; so long it offers its services."""
    past: dict[str, Any] = {"tag_id": "a", "sensor_type": "co2"}
    with (
        lupin_twin(domain, "web", *limits(answer_timeout_s=PATIENCE_S)) as process,
        Peer(domain) as robot,
        twin_node(domain, "--ros-args", "-p", "journal:=off") as twin,
        attached(process, robot) as live,
        ThreadPoolExecutor(1) as pool,
    ):
        wait_until_ready(live)
        robot.observe(scan("a", {"co2": 1.0}, (0, 0)))
        live.tag("a")
        field_of(live, sensor_type="co2")
        twin.freeze()
        asked = pool.submit(live.get, "/api/field", sensor_type="temperature")
        twin.kill()
        killed_s = time.monotonic()
        wait_for(lambda: live.get("/readyz").status_code == 503, "its silence")
        answers = [
            live.get("/api/field", sensor_type="humidity"),
            live.get("/api/history", **past),
            live.get("/api/state", at=1.0),
            asked.result(),
        ]
        # None has waited for the time-out, nor until DDS missed the twin.
        assert time.monotonic() - killed_s < DDS_LEASE_S
        for answer in answers:
            assert answer.status_code == 503, answer.text
            assert int(answer.headers["retry-after"]) >= 1
        assert "nothing was heard on /twin/state for 3 s" in answers[0].json()["detail"]
