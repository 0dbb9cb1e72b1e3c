"""Hostile clients and rows: the fleet's page goes on, and no site slows another."""

import os
import signal
import socket
import time
from collections import deque
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import httpx
import psycopg
import pytest
from websockets.exceptions import ConnectionClosed

from tests.support import raw_http
from tests.support.archive import Archive, forward_once, forwarder, run
from tests.support.fleet import Page, fleet, forward, frames, recent_scans, wall, write
from tests.support.journal import append, inspection, scan
from tests.support.postgres import Postgres, server
from tests.support.processes import children_of, constants, limits, lupin_twin
from tests.support.raw_http import UPGRADE, status
from tests.support.waiting import PATIENCE_S, wait_for
from tests.support.web import deaf_client
from tests.support.ws_client import open_websocket

TIMEOUT_S = 4
SITES = ("gh1", "gh2", "gh3", "gh4")
OTHER = "127.0.0.2"
YEAR_NS = 365 * 86_400 * 10**9
HISTORY = "api/history?tag_id=0&sensor_type=temperature"


def made(server: Postgres, journal: Path, *sites: str) -> Archive:
    archive = Archive(server)
    archive.add_user("page", "lupin_page")
    forward(archive, journal, recent_scans())
    archive.copy_site(*sites)
    return archive


@pytest.fixture(scope="module")
def page(postgresql: Postgres, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    """At most two sites may be open, and a client may have one request under way."""
    archive = made(postgresql, tmp_path_factory.mktemp("hostile") / "journal", *SITES[1:])
    bounds = limits(client_timeout_s=TIMEOUT_S, open_sites=2, concurrency=1)
    of = "lupin_bridge.feed.past_process"
    soon = constants(**{f"{of}:REST_S": 0.2, f"{of}:STUCK_S": 5.0})
    with fleet(archive, *bounds, *soon) as running:
        wait_for(lambda: {*running.sites()} == {*SITES}, "all sites")
        yield running
        assert "Traceback" not in running.process.output
        assert "shutting down" not in running.process.output
        assert running.process.exit_code is None


def of_address(page: Page, address: str) -> httpx.Client:
    transport = httpx.HTTPTransport(local_address=address)
    return httpx.Client(base_url=page.url, transport=transport, timeout=PATIENCE_S, trust_env=False)


def ws(page: Page, path: str) -> str:
    return page.url.replace("http", "ws", 1) + path


STRANGE = {
    b"/sites/%2e%2e/": 404,
    b"/sites/gh1/../../api/sites": 404,
    b"/sites/gh1%2f..%2fgh2/api/state": 404,
    b"/sites/gh1/sites/gh2/": 404,
    b"//sites/gh1/api/state": 404,
    b"/sites/%00/": 404,
    b"/sites/%0d%0aX-Evil:%20yes/": 404,
    b"/sites/%ff%fe/api/state": 404,
    b"/sites/" + b"x" * 4_000: 404,
    b"/sites/" + b"x" * 8_000: 414,
    b"/sites/gh1/api/history?tag_id=%00&sensor_type=co2": 400,
    "/sites/ü/".encode(): 400,
}


def test_a_malformed_path_is_refused_and_no_process_is_started_for_unknown_sites(
    page: Page,
) -> None:
    for path, expected in STRANGE.items():
        line = b"GET " + path + b" HTTP/1.1\r\n"
        plain = raw_http.answer(page.url, line + b"Host: 127.0.0.1\r\nConnection: close\r\n\r\n")
        assert status(plain) == expected, path
        assert b"x-evil" not in plain.lower().partition(b"\r\n\r\n")[0], path
        assert 400 <= status(raw_http.answer(page.url, line + UPGRADE + b"\r\n")) < 500, path
    before = page.metric("lupin_fleet_sites_open")
    for number in range(100):
        assert page.http.get(f"/sites/none{number}/api/state").status_code == 404
    assert page.metric("lupin_fleet_sites_open") == before


def test_a_client_that_reads_many_sites_loses_one_to_another_client(page: Page) -> None:
    with (
        open_websocket(ws(page, "/sites/gh1/ws/state")) as stored_on,
        open_websocket(ws(page, "/sites/gh2/ws/state")) as given_up,
    ):
        refused = page.http.get("/sites/gh3/api/state")
        assert refused.status_code == 503
        assert "2 sites are open here, the limit" in refused.json()["detail"]
        with of_address(page, OTHER) as other:
            assert other.get("/sites/gh3/api/state").status_code == 200
        with pytest.raises(ConnectionClosed, match="2 sites are open here, the limit"):
            deque(iter(lambda: given_up.recv(timeout=PATIENCE_S), None))
        # The first one is unchanged.
        while '"type":"s' not in str(stored_on.recv(timeout=PATIENCE_S)):
            pass
        assert page.metric("lupin_clients", "/sites/gh1") == 1
    assert page.metric("lupin_fleet_sites_open") <= 2


def test_simultaneous_requests_open_a_site_once(page: Page) -> None:
    for name in SITES[:2]:
        assert page.http.get(f"/sites/{name}/api/state").status_code == 200
    with ExitStack() as held:
        # Simultaneous handshakes for a site that has to replace another.
        clients = [held.enter_context(raw_http.connect(page.url)) for _ in range(6)]
        for client in clients:
            client.sendall(b"GET /sites/gh4/ws/state HTTP/1.1\r\n" + UPGRADE + b"\r\n")
        for client in clients:
            assert status(client.recv(65_536)) == 101
        wait_for(lambda: page.metric("lupin_clients", "/sites/gh4") == 6, "all on one page")
        assert page.metric("lupin_fleet_sites_open") <= 2


def test_a_client_that_does_not_read_has_no_more_requests_under_way_over_all_sites(
    page: Page,
) -> None:
    dear = "api/field.json?sensor_type=temperature&resolution=0.005"
    for name in SITES[:2]:
        assert page.http.get(f"/sites/{name}/api/state").status_code == 200
    with ExitStack() as held:

        def is_under_way() -> bool:
            deaf = held.enter_context(deaf_client(page.url, f"/sites/gh1/{dear}"))
            return deaf.recv(12) == b"HTTP/1.1 200"

        wait_for(is_under_way, "an answer of which only the first bytes are read")
        assert page.http.get(f"/sites/gh2/{HISTORY}").status_code == 429
        with of_address(page, OTHER) as other:
            assert other.get(f"/sites/gh2/{HISTORY}").status_code == 200
    wait_for(
        lambda: page.http.get(f"/sites/gh2/{HISTORY}").status_code == 200,
        "a place that is free again",
    )


def test_an_overview_client_that_never_reads_is_disconnected(
    postgresql: Postgres, tmp_path: Path
) -> None:
    # A frame of so many sites is more than a socket buffers.
    sites = [f"gh{number}" for number in range(2, 1_500)]
    archive = made(postgresql, tmp_path / "journal")
    archive.do(f"INSERT INTO site SELECT unnest('{{{','.join(sites)}}}'::text[]), ''")
    with fleet(archive, *limits(client_timeout_s=1.5)) as running:
        wait_for(lambda: len(running.sites()) > 1_000, "all sites")
        with frames(running) as received:
            next(received)
            with ExitStack() as held:
                for _ in range(5):
                    client = held.enter_context(raw_http.connect(running.url, room=4_096))
                    client.sendall(b"GET /ws/sites HTTP/1.1\r\n" + UPGRADE + b"\r\n")
                wait_for(lambda: running.metric("lupin_clients") == 6, "all of them")
                wait_for(lambda: running.metric("lupin_clients") == 1, "who reads alone")
            assert running.metric("lupin_clients_dismissed") == 5
            next(received)


def test_a_stopped_and_a_killed_process_are_replaced_and_counted(page: Page) -> None:
    assert page.http.get(f"/sites/gh1/{HISTORY}").status_code == 200

    def is_started_again(kind: str, after: signal.Signals) -> None:
        name = f"lupin_fleet_{kind}_starts"
        before = page.metric(name)
        (child,) = children_of(page.process.pid, kind.encode())
        os.kill(child, after)
        assert page.http.get("/sites/gh1/api/state").status_code == 200
        # The first time, the reader restarts at once; a query waits for it or is refused.
        wait_for(lambda: page.http.get(f"/sites/gh1/{HISTORY}").status_code == 200, "the past")
        wait_for(lambda: page.metric(name) > before, f"another {kind}")
        wait_for(lambda: page.http.get("/readyz").status_code == 200, "an archive that is read")

    is_started_again("watcher", signal.SIGSTOP)
    is_started_again("reader", signal.SIGKILL)


def test_an_archive_that_hangs_is_reported_and_recovers(tmp_path: Path) -> None:
    with server() as own:
        archive = made(own, tmp_path / "journal", "gh2")
        soon = constants(**{"lupin_bridge.fleet.source:STUCK_S": 3.0})
        with fleet(archive, *limits(answer_timeout_s=2), *soon) as running:
            for name in SITES[:2]:
                wait_for(lambda name=name: name in running.sites(), name)  # type: ignore[misc]
                # The first answer starts a process, which on a busy machine takes more than 2 s.
                path = f"/sites/{name}/{HISTORY}"
                wait_for(lambda path=path: running.http.get(path).status_code == 200, path)  # type: ignore[misc]
            own.freeze()
            try:
                wait_for(lambda: running.http.get("/readyz").status_code == 503, "it is said")
                assert "has not answered" in running.http.get("/readyz").json()["message"]
                assert running.http.get("/healthz").status_code == 200
                assert not running.sites()["gh1"]["is_live"]
                assert len(running.http.get("/sites/gh1/api/state").json()["tags"]) == 5
                paths = [f"/sites/{name}/{HISTORY}&points=7" for name in SITES[:2] * 2]
                with ThreadPoolExecutor() as clients:
                    for found in clients.map(running.http.get, paths):
                        assert found.status_code in (503, 504), found.text
                assert running.metric("lupin_fleet_archive_reachable") == 0
            finally:
                own.thaw()
            wait_for(lambda: running.http.get("/readyz").status_code == 200, "it to be back")
            wait_for(
                lambda: running.http.get(f"/sites/gh1/{HISTORY}&points=7").status_code == 200,
                "the past to be back",
            )
            assert "Traceback" not in running.process.output


def test_unreadable_rows_are_reported_on_the_page_of_their_site(
    archive: Archive, tmp_path: Path
) -> None:
    journal = tmp_path / "journal"
    now_ns = time.time_ns()
    write(journal, [*recent_scans(), inspection("1", now_ns - 10**9)])
    with forwarder(archive, journal), fleet(archive, *limits(answer_timeout_s=2)) as running:
        running.site(is_live=True, last_verdict="healthy")
        archive.copy_site("gh2")
        wait_for(lambda: "gh2" in running.sites(), "gh2")
        wait_for(lambda: running.http.get("/sites/gh1/api/state").status_code == 200, "gh1")
        archive.do("UPDATE scan SET readings = 'nonsense' WHERE site = 'gh1'")
        archive.do("UPDATE look SET blooms = '[[1' WHERE site = 'gh2'")
        for name, path in (("gh1", HISTORY), ("gh1", "api/export.csv"), ("gh2", HISTORY)):
            found = running.http.get(f"/sites/{name}/{path}")
            if name == "gh2" and found.status_code == 200:
                continue  # A history of readings needs no inspection.
            assert found.status_code == 503, found.text
            assert "ows of the site cannot be read" in found.json()["detail"]
        append(journal, [scan("0", time.time_ns())])

        def problem() -> str:
            return str(running.http.get("/sites/gh1/readyz").json()["input_problems"])

        wait_for(lambda: "cannot be read" in problem(), "the site's page to say so")
        looks = running.metric("lupin_fleet_looks")
        wait_for(lambda: running.metric("lupin_fleet_looks") > looks + 1, "it to be tried again")
        assert running.process.output.count("site gh1 is unchanged: rows of the site") == 1
        # The last known state stays.
        assert len(running.http.get("/sites/gh1/api/state").json()["tags"]) == 5
        assert running.http.get("/readyz").status_code == 200
        archive.do("UPDATE scan SET readings = '[21.5]' WHERE site = 'gh1'")
        append(journal, [scan("0", time.time_ns())])
        wait_for(lambda: problem() == "[]", "all to be well again")


def test_an_unreadable_or_slow_site_costs_no_other_site_its_status(
    archive: Archive, tmp_path: Path
) -> None:
    journal = tmp_path / "journal"
    forward(archive, journal, recent_scans())
    archive.copy_site("gh2", "gh3")
    archive.keep_live()
    archive.do("UPDATE scan SET readings = '{\"no\": \"list\"}' WHERE site = 'gh3'")
    # As `statement_timeout` ends it.
    archive.do(
        "CREATE FUNCTION ended() RETURNS boolean LANGUAGE plpgsql AS $$ BEGIN"
        " RAISE EXCEPTION 'it takes too long' USING ERRCODE = 'query_canceled'; END $$"
    )
    archive.do(
        "CREATE POLICY slow ON run AS RESTRICTIVE TO lupin_page"
        " USING (CASE site WHEN 'gh1' THEN ended() ELSE true END)"
    )
    with fleet(archive) as running:
        running.site("gh2", last_verdict="healthy", active_alarms=0)
        for name in ("gh1", "gh3"):
            found = running.site(name, last_verdict=None, active_alarms=None)
            assert found["verdict"] == "unknown"
            running.process.wait_for_output(f"site {name} cannot be judged: its status is unknown")
        for sites, total in (("gh2", 0), ("gh1,gh2", None)):
            assert running.http.get(f"/api/alarms?sites={sites}").json()["total"] == total
        assert running.http.get("/readyz").status_code == 200
        assert running.metric("lupin_fleet_watcher_starts") == 1
        assert "Traceback" not in running.process.output


def test_nothing_that_a_site_writes_stops_the_overview_of_the_others(
    archive: Archive, tmp_path: Path
) -> None:
    forward(
        archive, tmp_path / "journal", [*recent_scans(), inspection("1", time.time_ns() - 10**9)]
    )
    archive.copy_site("gh2")
    archive.keep_live()
    archive.add_user("gh2")
    # PostgreSQL holds it in the text of JSON, and JSON that is answered cannot.
    lone, size = "\\ud800", '"width": 0, "height": 0, "resolution": 1, "stamp_ns": 1, "cells": ""'
    origin = '"origin_x": 0, "origin_y": 0, "origin_yaw": 0'
    archive.do(f"""UPDATE series SET sensors = '["{lone}"]' WHERE (site, tag) = ('gh2', '1')""")
    archive.do(f"""UPDATE look SET blooms = '[[0, 0, 0, 0, "{lone}", 0, 0]]' WHERE site = 'gh2'""")
    plan = f'{{"frame_id": "{lone}", {origin}, {size}}}'
    archive.do(f"INSERT INTO meta VALUES ('gh2', 'map', '{plan}')")
    archive.do("UPDATE place SET x = 'NaN' WHERE (site, tag) = ('gh2', '0')")
    with fleet(archive) as running:
        running.site("gh2", is_live=True)
        for path in ("state", "tags/1", f"state?at={int(time.time())}", "report", "map"):
            found = running.http.get(f"/sites/gh2/api/{path}")
            assert (found.status_code, '"?"' in found.text) == (200, True), found.text
        found = running.http.get("/sites/gh2/api/field?sensor_type=temperature")
        assert (found.status_code, found.json()["sample_count"]) == (200, 3), found.text
        with psycopg.connect(archive.url("gh2"), autocommit=True) as site:
            for at in ("infinity", "0001-01-01"):
                site.execute("UPDATE forwarder SET heard_at = %s", (at,))
                running.site("gh2", is_live=at == "infinity")
                assert running.site("gh1")["is_live"], at
            site.execute("UPDATE epoch SET seq_offset = 9223372036854775807")
            site.execute("UPDATE hour SET total = 1.7e308")
            looks = running.metric("lupin_fleet_looks")
            wait_for(lambda: running.metric("lupin_fleet_looks") > looks + 1, "two looks")
        assert running.site("gh1")["is_live"]
        compared = running.http.get("/api/compare?sensor_type=temperature")
        assert compared.status_code == 503
        assert "a value cannot be read or written: invalid input" in compared.json()["detail"]


def test_a_sites_clock_may_be_wrong_by_a_year(archive: Archive, tmp_path: Path) -> None:
    sites = {"ahead": wall().stamp_ns + YEAR_NS, "behind": wall().stamp_ns - YEAR_NS}
    for name, now_ns in sites.items():
        rows = [scan("7", now_ns - each * 10**9, temperature=45.0) for each in range(5, 0, -1)]
        append(tmp_path / name, rows, replace(wall(), stamp_ns=now_ns, arrival_ns=now_ns))
        forward_once(archive.of_site(name), tmp_path / name)
    archive.keep_live()
    with fleet(archive) as running:
        for name, now_ns in sites.items():
            # Never healthy: how old a reading is, nobody knows.
            alarms = ["7"] if name == "ahead" else []  # those of a year ago are no longer active
            found = running.site(name, is_live=True, active_alarms=len(alarms), verdict="unknown")
            assert abs(found["last_received"]["sec"] - now_ns // 10**9) < 60
            below = f"/sites/{name}/api"

            wait_for(
                lambda below=below, alarms=alarms: (
                    [  # type: ignore[misc]
                        alarm["tag_id"]
                        for alarm in running.http.get(f"{below}/alarms").json()["alarms"]
                        if alarm["cleared_at"] is None
                    ]
                    == alarms
                ),
                "the same alarms on its own page",
            )
            (tag,) = running.http.get(f"{below}/state").json()["tags"]
            assert tag["stale_seconds"] is None if name == "ahead" else tag["stale_seconds"] >= 0
            # Nor on its own page.
            health = running.http.get(f"{below}/health").json()
            judged = health["house"], health["tags"]["7"]
            assert [it["verdict"] for it in judged] == ["unknown", "unknown"], name
            reason = running.http.get(f"/sites/{name}/readyz").json()["reason"]
            assert reason == ("clock_doubted" if name == "ahead" else "live")
            past = running.http.get(f"{below}/state?at={now_ns // 10**9 - 3}")
            # A moment in the past of the site can be queried.
            assert [it["tag_id"] for it in past.json()["tags"]] == ["7"]
            assert len(running.http.get(f"{below}/export.csv").text.splitlines()) == 6


@pytest.mark.parametrize(
    ("args", "message"),
    [
        ((), "--archive-url is missing, or LUPIN_ARCHIVE_URL"),
        (("--archive-url", "postgresql://a@b/c", "--site", "gh1"), "--site is for a twin, not for"),
        (("--ros-args", "-p", "a:=1"), "fleet takes no ROS arguments"),
    ],
)
def test_an_error_that_cannot_pass_ends_the_process(args: tuple[str, ...], message: str) -> None:
    done = run("fleet", "--port", "0", *args)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert message in done.stderr


def test_an_error_that_may_pass_is_reported_and_the_page_is_served(archive: Archive) -> None:
    archive.do("UPDATE archive SET version = 99")
    with fleet(archive) as page:
        page.process.wait_for_output("the archive is of version 99")
        answer = page.http.get("/readyz")
        assert answer.status_code == 503
        wait_for(
            lambda: "version 99" in page.http.get("/readyz").json()["message"], "the reason there"
        )
        assert page.sites() == {}
        archive.do("UPDATE archive SET version = 2")
        wait_for(lambda: page.http.get("/readyz").status_code == 200, "an archive that is read")
        assert page.sites() == {}, "an archive without sites is an empty overview"
        metrics = page.http.get("/metrics").text
        assert "lupin_fleet_archive_reachable 1" in metrics
        assert "lupin_fleet_sites 0" in metrics
        for path in ("/sites/gh9/", "/sites/gh9", "/sites/gh9/api/state", "/sites/", "/nonsense"):
            answer = page.http.get(path)
            assert answer.status_code == 404, path
        assert "no site 'gh9'" in page.http.get("/sites/gh9/").json()["detail"]
        for method in ("POST", "PUT", "DELETE"):
            assert page.http.request(method, "/api/sites").status_code == 405
        answer = page.http.get("/api/sites", headers={"Origin": "https://evil.example"})
        assert answer.status_code == 403


def test_a_slow_and_failing_archive_is_reported_once() -> None:
    soon = constants(**{"lupin_bridge.fleet.source:START_S": 0.5})
    with socket.create_server(("127.0.0.1", 0)) as database:
        url = f"postgresql://a@127.0.0.1:{database.getsockname()[1]}/b"
        with lupin_twin(0, "fleet", "--archive-url", url, *soon) as process:
            for _ in range(2):
                client, _ = database.accept()
                with client:
                    process.wait_for_output("has not answered")
            process.wait_for_output("server closed the connection")
            database.accept()[0].close()
            assert process.output.count("server closed the connection") == 1
