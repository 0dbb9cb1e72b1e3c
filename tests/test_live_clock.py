"""A twin whose clock does not run, or is wrong, reports it: over DDS, in `serve` and in `web`.

`web` knows it from `/diagnostics`.
"""

import time
from pathlib import Path
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rosgraph_msgs.msg import Clock

from tests.support.journal import SECOND, append
from tests.support.journal import scan as row
from tests.support.live import serve_and_web
from tests.support.messages import scan
from tests.support.processes import limits
from tests.support.waiting import PATIENCE_S, wait_for
from tests.support.web import Bridge

# No machine is too busy for an answer: the past process yields to all others.
PATIENT = limits(answer_timeout_s=PATIENCE_S)
SIM_TIME = ("--ros-args", "-p", "use_sim_time:=true", "-p", "state_publish_rate_hz:=10.0")


def tick(live: Bridge, seconds: int) -> None:
    clock = Clock()
    clock.clock.sec = seconds
    live.peer.publish("/clock", clock, depth=1)


def reason(live: Bridge) -> tuple[int, str]:
    answer = live.get("/readyz")
    return answer.status_code, answer.json()["reason"]


def age(live: Bridge) -> float | None:
    known: float | None = live.tag("1")["stale_seconds"]
    return known


def ages(live: Bridge, is_so: str) -> list[float]:
    """Two ages, one after the other; none if the clock's state differed before, between or after.

    On a busy machine 3 s pass between two queries, and without a tick it counts as stopped.
    """
    if reason(live) != (200, is_so):
        return []
    known = [it for it in (age(live), age(live)) if it is not None]
    return known if reason(live) == (200, is_so) and len(known) == 2 else []


def test_the_clock_never_starts_runs_is_paused_stops_and_runs_again() -> None:
    with serve_and_web(*SIM_TIME, of_both=PATIENT) as lives:
        check_clock(lives)


def check_clock(both: tuple[Bridge, Bridge]) -> None:
    twin, _ = both
    until = twin.peer.until
    twin.peer.observe(scan("1", {"co2": 1.0}, stamp_s=1_000.0))
    for live in both:
        until(lambda live=live: reason(live) == (503, "no_clock"), "no clock")  # type: ignore[misc]
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
        until(lambda live=live: reason(live) == (503, "clock_stopped"), "a clock that stopped")  # type: ignore[misc]
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
            peer.until(lambda live=live: reason(live) == (503, "clock_doubted"), "the doubt")  # type: ignore[misc]
            peer.until(lambda live=live: journal_of(live)["state"] == "doubting", "the journal's")  # type: ignore[misc]
            assert "contradicts the journal" in journal_of(live)["detail"]
            [tag] = live.json("/api/state")["tags"]
            assert ([it["value"] for it in tag["readings"]], tag["stale_seconds"]) == ([5.0], None)

        def levels() -> dict[str, bytes]:
            return {it.name: it.level for it in message[-1].status} if message else {}

        for name in ("/lupin_twin: clock", "/lupin_twin: journal"):
            peer.until(lambda name=name: levels().get(name) == DiagnosticStatus.ERROR, name)  # type: ignore[misc]
        assert "contradicts the journal" in lives[0].process.output
