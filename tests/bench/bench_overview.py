"""The page of a fleet: the overview of a thousand sites, and how many browsers it serves.

The overview is built on the server, painted, scrolled and changed, in a real browser. The readers
follow one site with a scan a second, a third of them each of three replicas. All is real: a journal
that a plain program writes, its forwarder, PostgreSQL, three `lupin-twin fleet`, and browsers in
further processes. All share this machine. The delay is from before the record in the journal until
a browser has read the frame.
"""

import os
import statistics
import tempfile
import threading
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path
from urllib.parse import urlsplit

from playwright.sync_api import Page as BrowserPage

from lupin_twin.core.state import Write
from tests.bench.live_parts import Clients, Seen
from tests.browser.conftest import chromium
from tests.support.archive import Archive, forward_once, forwarder
from tests.support.fleet import Page, fleet, recent_scans, write
from tests.support.journal import SECOND, pin, scan
from tests.support.postgres import server
from tests.support.proc_stat import cpu_s, resident_mb
from tests.support.waiting import wait_for

SITES, TAGS, SCANS = 1_000, 30, 3
_SCROLL = """async () => {
  const gaps = []; let before = performance.now();
  const step = (resolve) => requestAnimationFrame((now) => {
    gaps.push(now - before); before = now; window.scrollBy(0, 200);
    gaps.length < 150 ? step(resolve) : resolve();
  });
  await new Promise(step);
  return gaps.slice(5);
}"""


def tags_in_a_row() -> list[Write]:
    """Tags in a row, one of them too warm."""
    now_ns = time.time_ns()
    hot = [scan("3", now_ns - ago * SECOND, temperature=45.0) for ago in (2, 1)]
    return [*recent_scans(tags=TAGS, scans=SCANS), *hot]


def serve(page: Page) -> None:
    begun_s = time.monotonic()
    wait_for(
        lambda: sum(it["active_alarms"] is not None for it in page.sites().values()) == SITES,
        "all sites to be judged",
        timeout_s=600,
    )
    print(f"{SITES} sites judged within {time.monotonic() - begun_s:.0f} s", flush=True)
    for path in ("/api/sites", "/api/sites/gh0/map.svg"):
        took = []
        for _ in range(30):
            begun_s = time.perf_counter()
            body = page.http.get(path).content
            took.append((time.perf_counter() - begun_s) * 1e3)
        print(f"{path}: median {statistics.median(took):.1f} ms, {max(took):.1f} at most", end="")
        print(f", {len(body):,} bytes")


def paint(page: BrowserPage, url: str) -> None:
    page.goto(url, wait_until="commit")
    page.locator(".fleet-site").nth(SITES - 1).wait_for(state="attached")
    page.evaluate("() => new Promise((done) => requestAnimationFrame(() => setTimeout(done)))")
    print(f"painted {page.evaluate('performance.now()'):.0f} ms after the navigation began")
    gaps = page.evaluate(_SCROLL)
    print(f"scrolled: a frame each {statistics.median(gaps):.0f} ms, {max(gaps):.0f} at most")


def main() -> None:
    overview()
    readers()


def overview() -> None:
    with tempfile.TemporaryDirectory() as folder, server() as postgresql:
        archive = Archive(postgresql, "gh0")
        archive.add_user("page", "lupin_page")
        write(Path(folder) / "journal", tags_in_a_row())
        forward_once(archive, Path(folder) / "journal")
        archive.copy_site(*(f"gh{number}" for number in range(1, SITES)))
        archive.keep_live()
        with fleet(archive) as served:
            serve(served)
            with chromium() as browser:
                for _ in range(3):
                    with browser.new_context() as context:
                        paint(context.new_page(), served.url)


REPLICAS, TAGS_OF_A_SITE, MEASURED_S = 3, 30, 10.0
COUNTS = (300, 1_500, 3_000, 6_000)


def record(journal: Path, ending: threading.Event) -> None:
    """Scan a tag once a second, with the moment of the monotonic clock as a reading."""
    while not ending.wait(1.0):
        beat = time.monotonic()
        write(journal, [scan("0", time.time_ns(), beat=beat)])


def measure(ports: Sequence[int], pids: Sequence[int], count: int) -> None:
    """Print the figures of that many browsers."""
    share = count // REPLICAS
    with ExitStack() as stack:
        groups = [
            stack.enter_context(Clients(port, share, "/sites/gh0/ws/state?delta=1"))
            for port in ports
        ]
        joined_s = max(group.joined_s() for group in groups)
        start_s = time.monotonic() + 1.0
        time.sleep(1.0)
        before_s = [cpu_s(pid) for pid in pids]
        window = start_s, start_s + MEASURED_S
        with ThreadPoolExecutor(REPLICAS) as together:
            seen = list(together.map(lambda group: group.measure(*window), groups))
        took_s = time.monotonic() - start_s
        cores = [(cpu_s(pid) - was) / took_s for pid, was in zip(pids, before_s, strict=True)]
        memory = [resident_mb(pid) for pid in pids]
    delays = sorted(delay for each in seen for delay in each.delays_s)
    every = Seen(delays, seen[0].received, seen[0].frame_bytes)
    delivered = min(each.delivered(share) for each in seen)
    print(
        f"{count:>9,}{100 * delivered:>12.1f}{every.delay_ms(0.5):>11.0f}"
        f"{every.delay_ms(0.99):>9.0f}{joined_s:>10.1f}{max(cores):>16.2f}{max(memory):>12.0f}"
        f"{os.getloadavg()[0]:>8.0f}",
        flush=True,
    )


def readers() -> None:
    print(
        " browsers  delivered %  median ms   p99 ms  joined s  cores a replica  MB a replica  load"
    )
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        archive = Archive(stack.enter_context(server(fsync=True)), "gh0")
        archive.add_user("page", "lupin_page")
        journal, now_ns = folder / "gh0", time.time_ns()
        rows: list[Write] = [
            pin(str(tag), now_ns - 600 * SECOND, float(tag)) for tag in range(TAGS_OF_A_SITE)
        ]
        rows += [
            scan(str(tag), now_ns - SECOND, temperature=20.0, humidity=50.0, co2=410.0, light=300.0)
            for tag in range(TAGS_OF_A_SITE)
        ]
        write(journal, rows)
        stack.enter_context(forwarder(archive, journal))
        pages = [
            stack.enter_context(fleet(archive, "--max-clients", "8000")) for _ in range(REPLICAS)
        ]
        for page in pages:
            page.site("gh0", is_live=True)
            assert page.http.get("/sites/gh0/api/state").status_code == 200
        ending = threading.Event()
        recording = threading.Thread(target=record, args=(journal, ending))
        recording.start()
        stack.callback(recording.join)
        stack.callback(ending.set)
        ports = [urlsplit(page.url).port or 0 for page in pages]
        for count in COUNTS:
            measure(ports, [page.process.pid for page in pages], count)
