"""Faults over real processes, clocks included: clients get the truth, and all of it recovers."""

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from lupin_msgs.msg import TwinState, TwinTagState
from rosgraph_msgs.msg import Clock

from tests.support.domains import own_domain
from tests.support.journal import SECOND, append
from tests.support.journal import scan as row
from tests.support.live import attached, field_of, serve_and_web, wait_until_ready
from tests.support.messages import discovered, inspection, occupancy_grid, pose, scan
from tests.support.processes import OFTEN, constants, faults, limits, lupin_twin, twin_node
from tests.support.ros import Peer
from tests.support.waiting import PATIENCE_S, wait_for
from tests.support.web import Bridge, Frame, Listener, tag_ids

# Errors are counted with each heartbeat.
BEATS = constants(**{"lupin_bridge.feed.ros_thread:BEAT_PERIOD_S": 0.1})
FIELD: dict[str, Any] = {"sensor_type": "co2", "resolution": 0.5}


def reason(client: Listener, expected: str) -> Frame:
    """Read on to the status frame with this reason."""
    return client.until("status", lambda frame: frame["reason"] == expected)


def test_a_twin_is_killed_and_its_successor_has_fewer_tags(domain: int) -> None:
    with (
        lupin_twin(domain, "web") as process,
        Peer(domain, "robot") as robot,
        twin_node(domain) as twin,
        attached(process, robot) as live,
    ):
        wait_until_ready(live)
        with Peer(domain, "first_robot") as first_robot:
            first_robot.observe(scan("a", {"co2": 1.0}, (0, 0)), scan("b", {"co2": 2.0}, (1, 0)))
            live.tag("b")
        with live.listen() as client:
            client.until_tag("b")
            old = field_of(live, **FIELD).headers["etag"]

            twin.kill()
            message = reason(client, "stale")
            assert (message["twin"], live.get("/readyz").status_code) == ("offline", 503)
            assert "silent" in message["message"]
            assert live.json("/healthz")["ok"], "the bridge itself is well"
            assert tag_ids(live.json("/api/state")) == ["a", "b"], "the last that is known"
            old_s = live.tag("a")["stale_seconds"]
            wait_for(lambda: live.tag("a")["stale_seconds"] > old_s + 1.0, "it to grow old")
            assert live.json("/api/tags/a")["stale_seconds"] > old_s + 1.0

            with twin_node(domain):
                robot.observe(scan("c", {"co2": 3.0}, (2, 0)))
                reason(client, "live")
                latest = client.until_tag("c")
                assert tag_ids(latest["state"]) == ["c"]
                assert live.get("/readyz").status_code == 200
                assert field_of(live, **FIELD).json()["sample_count"] == 1
                field = live.get("/api/field", headers={"If-None-Match": old}, **FIELD)
                assert field.status_code == 200
                assert live.get("/api/tags/a").status_code == 404


def test_a_twin_is_stopped_and_goes_on(domain: int) -> None:
    with (
        lupin_twin(domain, "web", *limits(answer_timeout_s=1)) as process,
        Peer(domain) as robot,
        twin_node(domain) as twin,
        attached(process, robot) as live,
        live.listen() as client,
    ):
        robot.observe(scan("a", {"co2": 1.0}, (0, 0)))
        client.until_tag("a")
        field_of(live, **FIELD)
        advice = "/api/estimate/advice?sensor_type=temperature"
        wait_for(lambda: live.get(advice).status_code == 200, "the log of its twin")

        def reported_in_time() -> bool:
            twin.freeze()
            reported_s = reason(client, "stale")["state_age_seconds"]
            twin.thaw()
            reason(client, "live")
            field_of(live, **FIELD)
            return bool(reported_s <= 3.5)

        # As the client receives it; a busy machine may be late once.
        assert any(reported_in_time() for _ in range(5))

        twin.freeze()
        wait_for(lambda: live.get("/readyz").status_code == 503, "its silence")
        assert field_of(live, **FIELD).json()["sample_count"] == 1, "what is known of it still is"
        # A busy machine may take longer than a second.
        wait_for(
            lambda: live.get(advice).status_code == 200,
            "advice, which is made of the log",
        )

        twin.thaw()
        wait_until_ready(live)
        wait_for(
            lambda: live.json("/readyz")["journal"]["state"] == "recording",
            "what the twin says of itself",
        )
        robot.observe(scan("b", {"co2": 2.0}, (1, 0)))
        client.until_tag("b")
        wait_for(
            lambda: live.get("/api/field", **FIELD).json().get("sample_count") == 2,
            "a field with both tags",
        )


def test_a_second_twin_is_reported_by_the_real_name_of_its_topic_and_its_end_too(
    domain: int,
) -> None:
    soon = constants(**{"lupin_twin.ros.base_node:LEFT_OVER_S": 2.0})
    names = (("twin/state", "r1/state"), ("floranova/observations", "r1/observations"))
    remapped = ("--ros-args", *(word for it in names for word in ("-r", "/{}:=/{}".format(*it))))
    with (
        lupin_twin(domain, "web", *soon, *remapped) as process,
        lupin_twin(domain, "serve", *soon, *remapped) as first,
        Peer(domain) as robot,
        attached(process, robot) as live,
        live.listen() as client,
    ):
        reason(client, "live")
        with twin_node(domain, *remapped) as second:
            second.wait_for_output("lupin_twin in ROS domain")
            message = client.until("status", lambda frame: "2 twins" in frame["message"])
            first.wait_for_output("2 nodes publish /r1/state")
            assert (message["twin"], message["twin_count"]) == ("live", 2)
            assert "mixture" in message["message"]
            assert "2 twins" in live.json("/readyz")["message"]
            process.wait_for_output("2 nodes publish /r1/state")
            second.stop()
            client.until("status", lambda frame: frame["message"] == "The twin is live.")
        robot.publish("/r1/observations", scan(""))
        first.wait_for_output("dropped an entry on /r1/observations")


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


@pytest.fixture(scope="module")
def sabotaged_serve() -> Iterator[Bridge]:
    failing = faults(
        "--raise",
        "lupin_twin.core.state:TwinStore.record:boom-scan",
        "lupin_twin.core.state:TwinStore.record:boom-look",
        "lupin_twin.core.state:TwinStore.pin:boom-find",
        "lupin_twin.ros.convert:map_of:width=13",
        "lupin_twin.ros.convert_services:field_request_of:boom-field",
        "lupin_twin.ros.convert:StateMessages.build:boom-state:2",
        # Called for subscriptions, by the heartbeat and by the state's timer.
        "lupin_twin.core.state:TwinStore.snapshot:boom-snapshot:3",
    )
    with (
        own_domain() as domain,
        # The few states that are lost make no silence.
        lupin_twin(domain, "serve", *failing, *BEATS, *OFTEN) as process,
        Peer(domain) as robot,
        attached(process, robot) as live,
    ):
        robot.wait_for_twin()
        yield live


@pytest.fixture(scope="module")
def sabotaged_web() -> Iterator[Bridge]:
    failing = faults(
        "--raise",
        "lupin_twin.ros.convert:snapshot_of:boom-web",
        "lupin_twin.ros.convert:map_of:width=13",
    )
    with (
        own_domain() as domain,
        # The one state that is lost makes no silence.
        twin_node(domain, *OFTEN),
        lupin_twin(domain, "web", *failing, *BEATS) as process,
        Peer(domain) as robot,
        attached(process, robot) as live,
    ):
        robot.wait_for_twin()
        wait_until_ready(live)
        yield live


def errors(live: Bridge) -> int:
    """The number of callback errors that the bridge has counted."""
    return int(live.json("/healthz")["callback_errors"])


def goes_on_after(live: Bridge, fault: Callable[[], object], counted: int) -> None:
    """The fault is counted, and clients get what comes after it without a break."""
    before = errors(live)
    with live.listen() as client:
        client.until("state")
        fault()
        wait_for(lambda: errors(live) >= before + counted, f"{counted} counted errors")
        after = f"after {before + counted}"
        live.peer.observe(scan(after, {"co2": 1.0}))
        while True:
            frame = client.next()
            if frame["type"] == "status":
                assert frame["twin"] == "live"
            elif frame["type"] == "state" and after in tag_ids(frame["state"]):
                break
    assert live.json("/healthz")["ok"]
    assert "sabotage of" in live.process.output, "the log has the trace"


@pytest.mark.parametrize(
    ("fault", "counted"),
    [
        pytest.param(lambda peer: peer.observe(scan("boom-scan")), 1, id="a scan"),
        pytest.param(lambda peer: peer.observe(inspection("boom-look")), 1, id="an inspection"),
        pytest.param(lambda peer: peer.discover(discovered({"boom-find": pose()})), 1, id="a find"),
        pytest.param(lambda peer: peer.publish_map(occupancy_grid([[0] * 13])), 1, id="a map"),
        pytest.param(lambda peer: peer.observe(scan("boom-state")), 2, id="the state's timer"),
        pytest.param(lambda peer: peer.observe(scan("boom-snapshot")), 3, id="listeners"),
    ],
)
def test_serve_goes_on_after_an_exception_in(
    sabotaged_serve: Bridge, fault: Callable[[Peer], object], counted: int
) -> None:
    goes_on_after(sabotaged_serve, lambda: fault(sabotaged_serve.peer), counted)


def test_serve_goes_on_after_an_exception_in_the_service(sabotaged_serve: Bridge) -> None:
    request = {"sensor_type": "boom-field", "resolution": 1.0}

    def query() -> None:
        answer = sabotaged_serve.peer.get_field(**request)
        assert not answer.ok
        assert "sabotage" in answer.error_message

    goes_on_after(sabotaged_serve, query, 1)
    assert sabotaged_serve.peer.get_field(**request).ok


@pytest.mark.parametrize(
    ("fault", "counted"),
    [
        pytest.param(lambda peer: peer.observe(scan("boom-web")), 1, id="a state"),
        pytest.param(lambda peer: peer.publish_map(occupancy_grid([[0] * 13])), 1, id="a map"),
    ],
)
def test_web_goes_on_after_an_exception_in(
    sabotaged_web: Bridge, fault: Callable[[Peer], object], counted: int
) -> None:
    goes_on_after(sabotaged_web, lambda: fault(sabotaged_web.peer), counted)


# No machine is too busy for an answer: the past process yields to all others.
PATIENT = limits(answer_timeout_s=PATIENCE_S)
SIM_TIME = ("--ros-args", "-p", "use_sim_time:=true", "-p", "state_publish_rate_hz:=10.0")


def tick(live: Bridge, seconds: int) -> None:
    clock = Clock()
    clock.clock.sec = seconds
    live.peer.publish("/clock", clock, depth=1)


def status_of(live: Bridge) -> tuple[int, str]:
    answer = live.get("/readyz")
    return answer.status_code, answer.json()["reason"]


def age(live: Bridge) -> float | None:
    known: float | None = live.tag("1")["stale_seconds"]
    return known


def ages(live: Bridge, is_so: str) -> list[float]:
    """Two ages, one after the other; none if the clock's state differed before, between or after.

    On a busy machine 3 s pass between two queries, and without a tick it counts as stopped.
    """
    if status_of(live) != (200, is_so):
        return []
    known = [it for it in (age(live), age(live)) if it is not None]
    return known if status_of(live) == (200, is_so) and len(known) == 2 else []


def test_the_clock_never_starts_runs_is_paused_stops_and_runs_again() -> None:
    with serve_and_web(*SIM_TIME, of_both=PATIENT) as lives:
        check_clock(lives)


def check_clock(both: tuple[Bridge, Bridge]) -> None:
    twin, _ = both
    until = twin.peer.until
    twin.peer.observe(scan("1", {"co2": 1.0}, stamp_s=1_000.0))
    for live in both:
        until(lambda live=live: status_of(live) == (503, "no_clock"), "no clock")  # type: ignore[misc]
        assert age(live) is None

    seconds = 4_600

    def runs(live: Bridge) -> list[float]:
        nonlocal seconds
        seconds += 1
        tick(twin, seconds)
        return ages(live, "live")

    for live in both:
        known = until(lambda live=live: runs(live), "ages by a clock that runs")  # type: ignore[misc]
        assert min(known) >= 3_600.0

    def stands(live: Bridge) -> list[float]:
        tick(twin, seconds)
        return ages(live, "paused")

    for live in both:
        first, second = until(lambda live=live: stands(live), "ages by a clock that is paused")  # type: ignore[misc]
        assert first == second >= 3_600.0

    for live in both:
        # Observations go on; the latest of them is no younger for that.
        twin.peer.observe(scan("1", {"co2": 2.0}, stamp_s=float(seconds)))
        until(lambda live=live: status_of(live) == (503, "clock_stopped"), "a clock that stopped")  # type: ignore[misc]
        until(lambda live=live: age(live) is None, "no age")  # type: ignore[misc]
        until(lambda live=live: is_called_silent(live), "the alarm of that")  # type: ignore[misc]

    for live in both:
        until(lambda live=live: runs(live), "a clock that runs again")  # type: ignore[misc]
        until(lambda live=live: runs(live) and not is_called_silent(live), "its end")  # type: ignore[misc]
    for live in both:
        goes_back_during_a_query_of_the_past(twin, live, seconds - 100 * (1 + both.index(live)))
    assert "nothing comes on /clock" in twin.process.output
    assert twin.json("/healthz")["callback_errors"] == 0


def is_called_silent(live: Bridge) -> bool:
    active = live.json("/api/alarms?active=1")["alarms"]
    return "silent" in [alarm["reason"]["kind"] for alarm in active]


def goes_back_during_a_query_of_the_past(twin: Bridge, live: Bridge, seconds: int) -> None:
    """No answer of either time is an error, and connected clients get the new time."""
    requested = ("/api/state?at=1000", "/api/history?tag_id=1&sensor_type=co2", "/api/timeline")
    statuses: set[int] = set()

    def gone_back() -> bool:
        tick(twin, seconds)
        statuses.update(live.get(path).status_code for path in requested)
        return bool(live.json("/api/state")["header"]["stamp"]["sec"] == seconds)

    with live.listen() as listening:
        twin.peer.until(gone_back, "the clock's new time")
        listening.until("state", lambda frame: frame["state"]["header"]["stamp"]["sec"] == seconds)
    assert statuses == {200}
    later = live.get("/api/state", at=seconds + 90)
    assert (later.status_code, "later than now" in later.text) == (400, True)
    for path in requested[1:]:
        assert live.json(path)["to"]["sec"] == seconds
    # What it knew it still knows.
    found = wait_for(lambda: live.json("/api/state", at=seconds)["tags"], "the new run in the log")
    [tag] = found
    assert [reading["value"] for reading in tag["readings"]] == [2.0]


def test_a_clock_that_contradicts_the_journal_is_reported(tmp_path: Path) -> None:
    """As on a board that starts years ago; `test_memory_one_truth` has what a twin does then."""
    journal = tmp_path / "journal.sqlite"
    append(journal, [row("1", time.time_ns() + 86_400 * SECOND, co2=5.0)])
    of_journal = ("--ros-args", "-p", f"journal:={journal}")
    with serve_and_web(*of_journal, of_both=PATIENT) as lives:
        peer, message = lives[0].peer, list[DiagnosticArray]()
        peer.node.create_subscription(DiagnosticArray, "/diagnostics", message.append, 10)

        def journal_of(live: Bridge) -> Any:
            return live.get("/readyz").json()["journal"]

        for live in lives:
            peer.until(lambda live=live: status_of(live) == (503, "clock_doubted"), "the doubt")  # type: ignore[misc]
            peer.until(lambda live=live: journal_of(live)["state"] == "doubting", "the journal's")  # type: ignore[misc]
            assert "contradicts the journal" in journal_of(live)["detail"]
            [tag] = live.json("/api/state")["tags"]
            assert ([it["value"] for it in tag["readings"]], tag["stale_seconds"]) == ([5.0], None)

        def levels() -> dict[str, bytes]:
            return {it.name: it.level for it in message[-1].status} if message else {}

        for name in ("/lupin_twin: clock", "/lupin_twin: journal"):
            peer.until(lambda name=name: levels().get(name) == DiagnosticStatus.ERROR, name)  # type: ignore[misc]
        assert "contradicts the journal" in lives[0].process.output
