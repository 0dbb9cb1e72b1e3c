"""The overview of a thousand sites of 30 tags: built on the server, painted, scrolled, changed.

A real page over a real archive, and a real browser; all share this machine.
"""

import statistics
import tempfile
import time
from pathlib import Path

from playwright.sync_api import Page as BrowserPage

from lupin_twin.core.state import Write
from tests.browser.conftest import chromium
from tests.support.archive import Archive, forward_once
from tests.support.fleet import Page, fleet, recent_scans, write
from tests.support.journal import SECOND, scan
from tests.support.postgres import server
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


def rows() -> list[Write]:
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
    with tempfile.TemporaryDirectory() as folder, server() as postgresql:
        archive = Archive(postgresql, "gh0")
        archive.add_user("page", "lupin_page")
        write(Path(folder) / "journal", rows())
        forward_once(archive, Path(folder) / "journal")
        archive.copy_site(*(f"gh{number}" for number in range(1, SITES)))
        archive.keep_live()
        with fleet(archive) as served:
            serve(served)
            with chromium() as browser:
                for _ in range(3):
                    with browser.new_context() as context:
                        paint(context.new_page(), served.url)
