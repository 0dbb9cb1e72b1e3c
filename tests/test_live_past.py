"""The past of a twin with a journal, over ROS: past states, series and events, without delay."""

import sqlite3
import time
from collections.abc import Iterator
from contextlib import closing
from itertools import cycle
from pathlib import Path
from typing import Any

import pytest
from builtin_interfaces.msg import Time
from lupin_msgs.srv import GetHistory, GetStateAt

from tests.support.domains import own_domain
from tests.support.journal import append, select
from tests.support.journal import scan as row
from tests.support.messages import discovered, inspection, pose, scan
from tests.support.proc_stat import waited_s
from tests.support.processes import OFTEN, twin_node
from tests.support.ros import Peer
from tests.support.waiting import wait_for

STATE_AT, HISTORY = "/twin/get_state_at", "/twin/get_history"
# Observations of an afternoon long ago, s.
T = 1_700_000_000


@pytest.fixture(scope="module")
def peer(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Peer]:
    """A twin that has received all this."""
    path = tmp_path_factory.mktemp("journal") / "j.sqlite"
    with (
        own_domain() as domain,
        twin_node(domain, *OFTEN, "-p", f"journal:={path}"),
        Peer(domain) as peer,
    ):
        peer.wait_for_twin()
        peer.discover(discovered({"pinned": pose(5.0, 6.0)}))
        peer.observe(
            scan("a", {"co2": 400.0, "light": 9.0}, (1.0, 2.0), stamp_s=T),
            inspection(
                "a", "lupin", anomaly=True, bug_count=3, blooms=[(1.0, 2.0)], stamp_s=T + 10.0
            ),
            scan("a", {"co2": 500.0}, stamp_s=T + 100.5),
            scan("a", status=2, stamp_s=T + 110.0),
            scan("b", {"co2": 700.0}, stamp_s=T + 200.0),
            inspection("a", "lupin", stamp_s=T + 300.0),
            scan("late", {"co2": 1.0}, stamp_s=T + 10_000.0),
        )
        peer.tag("late")
        peer.tag("pinned")  # of another topic, which may be later
        wait_for(
            lambda: select(path, "SELECT count(*) FROM scan") == [(5,)],
            "all of it in the journal",
        )
        yield peer


def state_at(peer: Peer, at_s: float) -> Any:
    response = peer.call(GetStateAt, STATE_AT, at=stamp(at_s))
    assert response.ok, response.error_message
    assert response.error_message == ""
    assert response.state.header == response.times.header
    assert response.state.header.stamp == stamp(at_s)
    assert [tag.tag_id for tag in response.state.tags] == [t.tag_id for t in response.times.tags]
    return response


def stamp(at_s: float) -> Time:
    return Time(sec=int(at_s), nanosec=round(at_s % 1 * 1e9))


def stamp_ns(at_s: float) -> int:
    return int(stamp(at_s).sec) * 10**9 + int(stamp(at_s).nanosec)


def series(peer: Peer, tag_id: str, sensor_type: str, **more: Any) -> Any:
    response = peer.call(GetHistory, HISTORY, tag_id=tag_id, sensor_type=sensor_type, **more)
    assert response.ok, response.error_message
    return response


def reported(response: Any) -> list[tuple[float, float]]:
    """(seconds after T, value) of each entry."""
    return [
        (at.sec - T + at.nanosec / 1e9, mean)
        for at, mean in zip(response.stamps, response.means, strict=True)
    ]


def test_a_past_state_has_the_data_and_the_ages_of_its_moment(peer: Peer) -> None:
    response = state_at(peer, T + 50.0)
    tags = {tag.tag_id: tag for tag in response.state.tags}
    assert "b" not in tags
    a = tags["a"]
    assert {r.name: r.value for r in a.readings} == {"co2": 400.0, "light": 9.0}
    assert (a.species, a.anomaly, a.bug_count, len(a.flowers)) == ("lupin", True, 3, 1)
    assert a.stale_seconds == pytest.approx(40.0)
    [times] = [times for times in response.times.tags if times.tag_id == "a"]
    assert list(times.observed_at) == [stamp(T), stamp(T)]
    assert times.looked_at == times.last_try == stamp(T + 10.0)
    before, at_it = (state_at(peer, T + moment_s) for moment_s in (299.5, 300.0))
    times = next(times for times in before.times.tags if times.tag_id == "a")
    assert (times.last_try, times.last_try_status) == (stamp(T + 110.0), 2)
    # A moment includes observations exactly at it: of no pest any more.
    seen = [next(tag for tag in it.state.tags if tag.tag_id == "a") for it in (before, at_it)]
    assert [tag.anomaly for tag in seen] == [True, False]
    assert seen[1].stale_seconds == 0.0


def test_as_of_now_it_is_the_current_state(peer: Peer) -> None:
    latest = peer.state(lambda _: True, "a state")
    response = peer.call(GetStateAt, STATE_AT, at=latest.header.stamp)
    for tag in [*response.state.tags, *latest.tags]:
        tag.stale_seconds = 0.0
    by_id = {tag.tag_id: tag for tag in response.state.tags}
    assert by_id == {tag.tag_id: tag for tag in latest.tags}
    assert by_id["a"].pose.position.x == 1.0
    assert by_id["pinned"].pose.orientation.w == 1.0


def test_an_impossible_query_is_refused_by_name_without_data(peer: Peer) -> None:
    later = peer.call(GetStateAt, STATE_AT, at=Time(sec=2**31 - 1))
    assert "at is 2147483647.000000000 s, later than now, 1" in later.error_message
    assert later == GetStateAt.Response(error_message=later.error_message)
    nameless = peer.call(GetHistory, HISTORY, sensor_type="co2")
    assert nameless == GetHistory.Response(error_message="tag_id is empty")
    many = peer.call(GetHistory, HISTORY, tag_id="a", sensor_type="co2", max_points=5001)
    assert many.error_message == "max_points is 5001, the limits are 1 and 5000"


def test_readings_come_one_by_one_or_in_buckets(peer: Peer) -> None:
    assert reported(series(peer, "a", "co2")) == [(0.0, 400.0), (100.5, 500.0)]
    half = series(peer, "a", "co2", start=stamp(T + 0.0), end=stamp(T + 100.5))
    assert reported(half) == [(0.0, 400.0)]
    bucketed = series(peer, "a", "co2", start=stamp(T), end=stamp(T + 200), max_points=1)
    assert bucketed.is_bucketed
    assert (list(bucketed.counts), list(bucketed.means)) == ([2], [450.0])
    assert (list(bucketed.minima), list(bucketed.maxima)) == ([400.0], [500.0])
    assert reported(series(peer, "a", "ph")) == []
    assert reported(series(peer, "*", "~looks")) == [(10.0, 3.0), (300.0, 0.0)]
    assert list(series(peer, "*", "~runs").minima) == [0.0], "by no simulated clock"


SITE, SCANS, OBSERVED, RATE, AT_ONCE = 300, 200_000, 400, 200, 8
# When they begin, s: after all scans.
LATER = T + 1_000.0
MORE_SCANS = """
WITH RECURSIVE later (n) AS (SELECT 1 UNION ALL SELECT n + 1 FROM later WHERE n < ?)
INSERT INTO scan SELECT
    site, seq + n * 1000, series, stamp_ns + n * 1000000, own_stamp_ns, arrival_ns,
    status, source, mission, detail, is_copy, readings
FROM later, (SELECT * FROM scan ORDER BY seq LIMIT 1)"""


def pieces(pid: int) -> Iterator[range]:
    """The numbers of `OBSERVED` observations, when they are due.

    `RATE` a second of what the machine leaves to a process: of the time in which its threads wait
    for a core, a tenth. Late ones come in pieces that fit into a topic twice.
    """
    sent, due, before_s, waited_before_s = 0, 0.0, time.monotonic(), waited_s(pid)
    while sent < OBSERVED:
        now_s, now_waited_s = time.monotonic(), waited_s(pid)
        passed_s = now_s - before_s
        due += RATE * max(0.1 * passed_s, passed_s - (now_waited_s - waited_before_s))
        before_s, waited_before_s = now_s, now_waited_s
        piece = range(sent, min(int(due), sent + 20, OBSERVED))
        sent, due = piece.stop, min(due, piece.stop + 1.0)
        yield piece


def test_a_flood_of_expensive_queries_loses_no_observation(domain: int, tmp_path: Path) -> None:
    """A topic holds 50: a quarter of a second without a read would lose some.

    To count a tag's scans takes longer than that, and a state of all tags is the largest response.
    """
    journal = tmp_path / "j.sqlite"
    append(journal, (row(f"t{number}", T * 10**9, co2=4.0) for number in range(SITE)))
    with closing(sqlite3.connect(journal)) as connection, connection:
        connection.execute(MORE_SCANS, (SCANS,))
    of_journal = ("-p", f"journal:={journal}", "-p", "journal_days:=36500.0")
    with (
        twin_node(domain, "--ros-args", *of_journal) as twin,
        Peer(domain, "robot") as robot,
        Peer(domain, "curious") as curious,
    ):
        # Once the first has arrived, so does all that a topic holds; until then, the oldest go.
        robot.observe(scan("beside", {"co2": 0.0}, stamp_s=LATER - 0.5))
        first = f"SELECT 1 FROM scan WHERE stamp_ns = {stamp_ns(LATER - 0.5)}"
        wait_for(lambda: select(journal, first), "the first in the journal")
        questions = (
            (GetStateAt, STATE_AT, GetStateAt.Request(at=stamp(LATER - 1.0))),
            (GetHistory, HISTORY, GetHistory.Request(tag_id="t0", sensor_type="~scans")),
        )
        clients = [(curious.node.create_client(kind, name), it) for kind, name, it in questions]
        turns = cycle(clients)
        for client, _ in clients:
            curious.until(client.service_is_ready, "the service")
        requested: list[Any] = []
        answers: list[Any] = []

        def query(_: float = 0.0) -> None:
            answers.extend(future.result() for future in requested if future.done())
            requested[:] = [future for future in requested if not future.done()]
            while len(requested) < AT_ONCE:
                client, request = next(turns)
                requested.append(client.call_async(request))
            curious.spin_briefly()

        for piece in pieces(twin.pid):
            for number in piece:
                robot.observe(scan("beside", {"co2": number}, stamp_s=LATER + number / RATE))
            query()
        last = f"SELECT 1 FROM scan WHERE stamp_ns = {stamp_ns(LATER + (OBSERVED - 1) / RATE)}"
        wait_for(lambda: select(journal, last), "the last of them in the journal", meanwhile=query)
        kinds = {kind.Response for kind, *_ in questions}
        wait_for(lambda: {*map(type, answers)} == kinds, "an answer to each", meanwhile=query)
        observed = f"SELECT count(*) FROM scan WHERE stamp_ns >= {stamp_ns(LATER)}"
        assert select(journal, observed) == [(OBSERVED,)]
        assert "they arrived too fast" not in twin.output
        assert all(answer.ok for answer in answers)
        states = [answer.state for answer in answers if isinstance(answer, GetStateAt.Response)]
        assert {len(state.tags) for state in states} == {SITE}
