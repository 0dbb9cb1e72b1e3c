"""A real `lupin-twin fleet` over a real archive, and greenhouses that forward to it."""

import json
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx

from lupin_twin.core.state import Write
from lupin_twin.journal.runs import Clock
from tests.support.archive import Archive, forward_once
from tests.support.journal import SECOND, append, pin, scan
from tests.support.processes import Process, lupin_twin, url_of
from tests.support.waiting import PATIENCE_S, wait_for
from tests.support.ws_client import open_websocket


def wall() -> Clock:
    """The wall clock now, as on a robot."""
    now_ns = time.time_ns()
    return Clock(now_ns, now_ns, is_simulated=False)


def recent_scans(temperature: float = 22.0, tags: int = 5, scans: int = 6) -> list[Write]:
    """Tags with their positions, each scanned once a minute until now."""
    now_ns = time.time_ns()
    pins: list[Write] = [pin(str(tag), now_ns - 600 * SECOND, float(tag)) for tag in range(tags)]
    return pins + [
        scan(str(tag), now_ns - (scans - number) * 60 * SECOND + tag, temperature=temperature)
        for number in range(scans)
        for tag in range(tags)
    ]


def write(journal: Path, rows: list[Write]) -> None:
    """As its twin writes them."""
    append(journal, rows, wall())


def forward(archive: Archive, journal: Path, rows: list[Write]) -> None:
    """Write a journal, and forward it to the archive."""
    write(journal, rows)
    forward_once(archive, journal)


class Page:
    def __init__(self, process: Process) -> None:
        self.process = process
        self.url = url_of(process)
        self.http = httpx.Client(base_url=self.url, timeout=PATIENCE_S, trust_env=False)

    def sites(self) -> dict[str, dict[str, Any]]:
        answer = self.http.get("/api/sites")
        assert answer.status_code == 200, answer.text
        return {site["site"]: site for site in answer.json()["sites"]}

    def metric(self, name: str, below: str = "") -> float:
        """A metric, of the fleet or of one site."""
        lines = self.http.get(f"{below}/metrics").text.splitlines()
        return next(float(line.split()[1]) for line in lines if line.startswith(f"{name} "))

    def site(self, name: str = "gh1", **message: Any) -> dict[str, Any]:
        """A site's entry once it has these values."""

        def check() -> dict[str, Any] | None:
            found = self.sites().get(name, {})
            return found if found and all(found[key] == it for key, it in message.items()) else None

        found = wait_for(check, f"{name} with {message}: {self.sites()}")
        assert found is not None
        return found


@contextmanager
def fleet(archive: Archive, *args: str, user: str = "page") -> Iterator[Page]:
    with lupin_twin(0, "fleet", "--archive-url", archive.url(user), *args) as process:
        page = Page(process)
        with page.http:
            yield page


@contextmanager
def frames(page: Page) -> Iterator[Iterator[dict[str, Any]]]:
    with open_websocket(page.url.replace("http", "ws", 1) + "/ws/sites") as connection:

        def each() -> Iterator[dict[str, Any]]:
            while True:
                yield json.loads(connection.recv(timeout=PATIENCE_S))

        yield each()
