"""A site's page and every route below it answer from its log, as the journal itself would."""

import io
import signal
import time
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import httpx
import pytest
from PIL import Image
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection

from lupin_twin.field.explored import OccupancyMap, text_of
from tests.support import maps
from tests.support.archive import Archive, forwarder
from tests.support.docs import block_named
from tests.support.fleet import Page, fleet, forward, recent_scans, write
from tests.support.journal import opened, scan
from tests.support.nginx import nginx
from tests.support.waiting import PATIENCE_S, wait_for
from tests.support.ws_client import open_websocket

MINUTE_NS = 60_000_000_000


def test_a_site_is_also_judged_by_its_last_day_as_on_its_own_page(
    archive: Archive, tmp_path: Path
) -> None:
    journal = tmp_path / "journal.sqlite"
    now_ns = time.time_ns()
    cold = [scan("a", now_ns - n * 60 * MINUTE_NS, temperature=13.0) for n in range(60, 0, -1)]
    write(journal, [*cold, scan("a", now_ns, temperature=20.0)])
    with forwarder(archive, journal), fleet(archive) as page:
        page.site(verdict="stressed")

        def reasons(query: str = "") -> list[str]:
            tags = page.http.get(f"/sites/gh1/api/health{query}").json()["tags"]
            return [reason["sensor"] for reason in tags.get("a", {}).get("reasons", ())]

        wait_for(lambda: reasons() == ["temperature_24h_mean"], "the same on its page")
        assert reasons(f"?at={now_ns / 1e9 + 0.001:.3f}") == ["temperature_24h_mean"]


def test_a_sites_page_is_below_its_path_and_follows_its_log(
    archive: Archive, tmp_path: Path
) -> None:
    """`test_live_same_answers` compares it with `serve`, answer by answer."""
    journal = tmp_path / "journal.sqlite"
    write(journal, recent_scans())
    with forwarder(archive, journal), fleet(archive) as page:
        page.site(is_live=True, verdict="healthy")
        moved = page.http.get("/sites/gh1")
        assert (moved.status_code, moved.headers["location"]) == (307, "gh1/")

        def get(path: str) -> httpx.Response:
            return page.http.get(f"/sites/gh1/{path}")

        assert get("readyz").json()["twin"] == "live"
        field = get("api/field?sensor_type=temperature&resolution=0.5")
        assert field.json()["sample_count"] == 5
        # The twin has sent no map.
        assert get("api/map").status_code == 404
        quality = get("api/estimate/quality").json()["sensors"]["temperature"]
        assert quality["fit_problem"] == ""
        write(journal, [scan("new", time.time_ns(), temperature=22.0)])
        wait_for(lambda: len(get("api/state").json()["tags"]) == 6, "the tag that is new")


def test_the_floor_plan_is_the_same_as_the_twins(archive: Archive, tmp_path: Path) -> None:
    # One half is unexplored: tags 0 to 2 stand in the other.
    floor = maps.map_of([[0] * 6 + [-1] * 6] * 8, resolution=0.5)
    journal = tmp_path / "journal.sqlite"
    write(journal, recent_scans())
    with forwarder(archive, journal), fleet(archive) as page:
        page.site(is_live=True, verdict="healthy")

        def get(path: str) -> httpx.Response:
            return page.http.get(f"/sites/gh1/api/{path}")

        def shows(it: OccupancyMap) -> bool:
            return bool(get("map").json().get("info", {}).get("width") == it.width)

        assert get("map").status_code == 404
        for shown in (floor, maps.map_of([[0, 0]])):
            with opened(journal) as file:
                file.put_map(shown, partial(text_of, shown))
            write(journal, [scan("0", time.time_ns(), temperature=22.0)])
            wait_for(partial(shows, shown), "the floor plan")
            assert get("map").json()["info"]["resolution"] == shown.resolution
            with Image.open(io.BytesIO(get("map.png").content)) as picture:
                assert picture.size == (shown.width, shown.height)
        with opened(journal) as file:
            file.put_map("", str)  # too large
        write(journal, [scan("0", time.time_ns(), temperature=22.0)])
        wait_for(lambda: get("map").status_code == 404, "no floor plan")
        archive.do("UPDATE meta SET value = '{\"width\": 5}' WHERE site = 'gh1' AND key = 'map'")
        write(journal, [scan("0", time.time_ns(), temperature=22.0)])
        page.process.wait_for_output("the floor plan of gh1 cannot be read")
        assert len(get("state").json()["tags"]) == 5
        assert get("map").status_code == 404


SHOWN = ("--trusted-proxy", "127.0.0.1", "--allow-host", "fleet.example")
BROWSERS = 4


@dataclass
class Replicas:
    url: str
    pages: list[Page]
    journal: Path
    archive: Archive


@pytest.fixture(scope="module")
def replicas(
    shared_archive: Archive, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Replicas]:
    archive, folder = shared_archive, tmp_path_factory.mktemp("replicas")
    journal = folder / "journal"
    forward(archive, journal, recent_scans())
    archive.do("UPDATE forwarder SET heard_at = now() - INTERVAL '1 hour'")
    with ExitStack() as stack:
        pages = [stack.enter_context(fleet(archive, *SHOWN)) for _ in range(3)]
        ports = [int(page.url.rpartition(":")[2]) for page in pages]
        text = block_named("fleet-nginx").text
        url = stack.enter_context(nginx(folder, ports, text))
        yield Replicas(url, pages, journal, archive)


ANSWERS = (
    "sites/gh1/api/field?sensor_type=temperature&resolution=0.5",
    "sites/gh1/api/field.png?sensor_type=temperature&resolution=0.5",
    "sites/gh1/api/state?at={at}",
    "sites/gh1/api/health?at={at}",
    "sites/gh1/api/field?sensor_type=temperature&resolution=0.5&at={at}",
    "sites/gh1/api/estimate?sensor_type=temperature&resolution=0.5&at={at}",
)


def test_all_replicas_give_an_answer_the_same_etag(replicas: Replicas) -> None:
    for page in replicas.pages:
        # Silent, so that nothing changes any more.
        page.site(is_live=False, last_verdict="healthy", active_alarms=1)
        for path in ("state", "report"):  # the state opens the site; a report is of until now
            answer = page.http.get(f"/sites/gh1/api/{path}")
            assert answer.status_code == 200, answer.text
    at = int(time.time()) - 90
    with httpx.Client(base_url=replicas.url, trust_env=False, timeout=PATIENCE_S) as browser:
        for path in (f"/{it.format(at=at)}" for it in ANSWERS):
            found = [page.http.get(path) for page in replicas.pages]
            assert [it.status_code for it in found] == [200] * 3, path
            (etag,) = {it.headers["etag"] for it in found}
            assert len({it.content for it in found}) == 1, path
            # From whichever replica nginx chooses next.
            for _ in range(3):
                again = browser.get(path, headers={"If-None-Match": etag})
                assert again.status_code == 304, path


def until_critical(browser: ClientConnection) -> None:
    while '"critical"' not in str(browser.recv(timeout=PATIENCE_S)):
        pass


def test_killing_a_replica_interrupts_no_client(replicas: Replicas) -> None:
    for page in replicas.pages:
        page.site(last_verdict="healthy")
        assert page.http.get("/sites/gh1/api/state").status_code == 200
    base = replicas.url.replace("http", "ws", 1)
    with ExitStack() as stack, forwarder(replicas.archive, replicas.journal):
        browsers = []
        # One after the other, so that each replica has some of them.
        for path in ("/ws/sites", "/sites/gh1/ws/state") * BROWSERS:
            browsers.append((path, stack.enter_context(open_websocket(base + path))))
            browsers[-1][1].recv(timeout=PATIENCE_S)
        replicas.pages[0].process.send(signal.SIGKILL)
        with httpx.Client(base_url=replicas.url, trust_env=False, timeout=PATIENCE_S) as client:
            for path in ("/api/sites", f"/{ANSWERS[1]}") * 10:
                assert client.get(path).status_code in (200, 429), "nginx tries another replica"
        for _ in range(2):
            write(replicas.journal, [scan("new", time.time_ns(), temperature=50.0)])
        returns = 0
        for path, browser in browsers:
            try:
                until_critical(browser)
            except ConnectionClosed:
                # Another replica takes each disconnected client at the first attempt.
                returns += 1
                until_critical(stack.enter_context(open_websocket(base + path)))
        assert 0 < returns < len(browsers), "browsers are spread"
