"""Three replicas behind a real nginx as the guide configures it: one answer, and one is lost."""

import signal
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path

import httpx
import pytest
from websockets.exceptions import ConnectionClosed, InvalidHandshake

from tests.support.archive import Archive, forward_once, forwarder
from tests.support.docs import block_named
from tests.support.fleet import Page, fleet, scans_lately, write
from tests.support.journal import scan
from tests.support.nginx import nginx
from tests.support.waiting import PATIENCE_S, wait_for
from tests.support.ws_client import open_websocket

SHOWN = ("--trusted-proxy", "127.0.0.1", "--allow-host", "fleet.example")
BROWSERS = 4
PAUSE_S = 0.5


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
    write(journal, scans_lately())
    forward_once(archive, journal)
    archive.do("UPDATE forwarder SET heard_at = now() - INTERVAL '1 hour'")
    with ExitStack() as stack:
        pages = [stack.enter_context(fleet(archive, *SHOWN)) for _ in range(3)]
        ports = [int(page.url.rpartition(":")[2]) for page in pages]
        text = block_named("fleet-nginx").text
        url = stack.enter_context(nginx(folder, ports, text))
        yield Replicas(url, pages, journal, archive)


# --- one answer -----------------------------------------------------------------------------------

ANSWERS = (
    "api/sites",
    "sites/gh1/api/field?sensor_type=temperature&resolution=0.5",
    "sites/gh1/api/field.png?sensor_type=temperature&resolution=0.5",
    "sites/gh1/api/state?at={at}",
    "sites/gh1/api/health?at={at}",
    "sites/gh1/api/field?sensor_type=temperature&resolution=0.5&at={at}",
    "sites/gh1/api/estimate?sensor_type=temperature&resolution=0.5&at={at}",
)


def test_an_answer_has_one_etag_on_all_replicas(replicas: Replicas) -> None:
    for page in replicas.pages:
        # Silent, so that nothing changes any more.
        page.site(is_live=False, last_verdict="healthy", active_alarms=1)
    at = int(time.time()) - 90
    with httpx.Client(base_url=replicas.url, trust_env=False, timeout=PATIENCE_S) as browser:
        for path in (f"/{it.format(at=at)}" for it in ANSWERS):
            found = [page.http.get(path) for page in replicas.pages]
            assert [it.status_code for it in found] == [200] * 3, path
            (etag,) = {it.headers["etag"] for it in found}
            if path != "/api/sites":  # which says how long ago it was that something came
                assert len({it.content for it in found}) == 1, path
            # From whichever nginx takes next.
            for _ in range(3):
                again = browser.get(path, headers={"If-None-Match": etag})
                assert again.status_code == 304, path


# --- a replica is lost ----------------------------------------------------------------------------


@dataclass
class Browser:
    """Connects again after half a second, later where that fails: as the page does."""

    url: str
    frames: int = 0
    text: str = ""
    returns: int = 0
    failures: int = 0
    longest_s: float = 0.0
    last_s: float = 0.0
    is_over: bool = False
    problem: Exception | None = None

    def run(self) -> None:
        try:
            while not self.is_over:
                try:
                    with open_websocket(self.url) as socket:
                        while not self.is_over:
                            self._take(str(socket.recv(timeout=PATIENCE_S)))
                except (ConnectionClosed, InvalidHandshake, OSError) as error:
                    self.returns += 1
                    self.failures += not isinstance(error, ConnectionClosed)
                    until_s = time.monotonic() + PAUSE_S
                    wait_for(lambda until_s=until_s: time.monotonic() > until_s, "the pause")  # type: ignore[misc]
        except Exception as error:  # noqa: BLE001  # told by the test
            self.problem = error

    def _take(self, text: str) -> None:
        now_s = time.monotonic()
        if self.last_s:
            self.longest_s = max(self.longest_s, now_s - self.last_s)
        self.frames, self.text, self.last_s = self.frames + 1, self.text + text, now_s


@dataclass
class Load:
    """Requests all the time; what was neither an answer nor a limit of ours is kept."""

    url: str
    answers: int = 0
    strange: list[str] = field(default_factory=list)
    is_over: bool = False

    def run(self) -> None:
        paths = ("/api/sites", "/sites/gh1/api/field?sensor_type=temperature&resolution=0.1")
        with httpx.Client(base_url=self.url, trust_env=False, timeout=PATIENCE_S) as client:
            while not self.is_over:
                for path in paths:
                    try:
                        status = client.get(path).status_code
                    except (httpx.RemoteProtocolError, httpx.ReadError):
                        continue  # amid its answer
                    if status not in (200, 429):
                        self.strange.append(f"{path}: {status}")
                self.answers += 1


def test_a_replica_that_is_killed_is_missed_by_nobody(replicas: Replicas) -> None:
    for page in replicas.pages:
        page.site(last_verdict="healthy")
        assert page.http.get("/sites/gh1/api/state").status_code == 200
    base = replicas.url.replace("http", "ws", 1)
    paths = ("/ws/sites", "/sites/gh1/ws/state")
    browsers = [Browser(base + path) for path in paths * BROWSERS]
    load = Load(replicas.url)
    runs = [*(it.run for it in browsers), load.run]
    threads = [threading.Thread(target=run) for run in runs]
    with forwarder(replicas.archive, replicas.journal):
        try:
            # One after the other, so that each replica has some of them.
            for thread, browser in zip(threads, browsers, strict=False):
                thread.start()
                wait_for(lambda it=browser: it.frames, "frames at a browser")  # type: ignore[misc]
            threads[-1].start()
            wait_for(lambda: load.answers > 5, "answers under load")
            before = load.answers
            for it in browsers:
                it.longest_s = 0.0
            replicas.pages[0].process.send(signal.SIGKILL)
            wait_for(lambda: any(it.returns for it in browsers), "browsers that are cut off")
            write(replicas.journal, [scan("new", time.time_ns(), temperature=50.0)])
            write(replicas.journal, [scan("new", time.time_ns(), temperature=50.0)])
            wait_for(
                lambda: all('"critical"' in it.text for it in browsers), "all to see what is new"
            )
            wait_for(lambda: load.answers > before + 10, "answers from the others")
        finally:
            load.is_over = True
            for it in browsers:
                it.is_over = True
            for thread in threads:
                if thread.ident is not None:
                    thread.join()
    print(f"longest without a frame: {max(it.longest_s for it in browsers):.2f} s")
    cut_off = [it for it in browsers if it.returns]
    assert len(cut_off) < len(browsers), "browsers are spread"
    assert [it.problem for it in browsers] == [None] * len(browsers)
    # Whoever was cut off was taken by another replica at the first attempt.
    assert [it.failures for it in browsers] == [0] * len(browsers)
    assert load.strange == [], "nginx asks another replica"
