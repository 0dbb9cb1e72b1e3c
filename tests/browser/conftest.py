"""Chromium for the browser tests, and pages of the HMI in it."""

import itertools
import os
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

import pytest
from playwright.sync_api import Browser, expect, sync_playwright

from tests.browser.greenhouse import TAGS, furnish
from tests.browser.hmi import Hmi, OpenPage, open_hmi
from tests.support.domains import own_domain
from tests.support.ros import Peer, clock_at
from tests.support.waiting import PATIENCE_S
from tests.support.web import Bridge, bridge

CHROMIUM = os.environ.get("CHROMIUM", "/usr/bin/chromium")
# Two pages of Chromium's own for the address bar, unused here, take a sixth of the time.
# The last of such switches counts: it repeats those of Playwright that matter on loopback.
NOT_WANTED = (
    "WebUIOmniboxPopup",
    "WebUIOmniboxAimPopup",
    "AvoidUnnecessaryBeforeUnloadCheckSync",
    "DestroyProfileOnBrowserClose",
    "HttpsUpgrades",
    "HttpsFirstBalancedModeAutoEnable",
    "LensOverlay",
    "MediaRouter",
    "PaintHolding",
    "ThirdPartyStoragePartitioning",
    "OptimizationHints",
    "NetworkTimeServiceQuerying",
    "AimEnabled",
    "PreconnectToSearch",
)
# No GPU, and no connection to the outside.
CHROMIUM_ARGS = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    # Each page starts in a process that exists already, a tenth of the cost.
    "--renderer-process-limit=1",
    f"--disable-features={','.join(NOT_WANTED)}",
)


@contextmanager
def chromium() -> Iterator[Browser]:
    """The browser of tests, benchmarks and pictures."""
    with (
        sync_playwright() as playwright,
        playwright.chromium.launch(
            executable_path=CHROMIUM, args=list(CHROMIUM_ARGS), headless=True
        ) as browser,
    ):
        yield browser


# Not by session: Playwright keeps an event loop running in this thread, and other tests of the
# same worker call asyncio.run().
@pytest.fixture(scope="package")
def browser() -> Iterator[Browser]:
    expect.set_options(timeout=PATIENCE_S * 1000)
    with chromium() as launched:
        yield launched


TICK_S = 0.5


@contextmanager
def ticking(peer: Peer, started_s: float) -> Iterator[None]:
    """Simulated time that advances by a millisecond a tick."""
    has_ended = threading.Event()

    def tick() -> None:
        for ticks in itertools.count(1):
            if has_ended.wait(TICK_S):
                return
            peer.publish("/clock", clock_at(started_s + ticks / 1000), depth=1)

    thread = threading.Thread(target=tick)
    thread.start()
    try:
        yield
    finally:
        has_ended.set()
        thread.join()


@contextmanager
def bridge_of_a_moment() -> Iterator[tuple[Bridge, float]]:
    """A server whose clock almost stands still, and its time, s.

    It advances by a millisecond a tick, since otherwise it would count as paused.
    """
    simulated = ("--ros-args", "-p", "use_sim_time:=true")
    with own_domain() as domain, bridge(*simulated, domain=domain) as running:
        started_s = time.time()
        running.peer.set_clock(started_s)
        with ticking(running.peer, started_s):
            yield running, started_s


@pytest.fixture(scope="package")
def greenhouse() -> Iterator[Bridge]:
    """A server with the greenhouse of `greenhouse.py`, for tests that change nothing in it.

    No pin fades between two pictures.
    """
    with bridge_of_a_moment() as (running, _):
        furnish(running)
        yield running


@pytest.fixture
def open_page(browser: Browser) -> Iterator[OpenPage]:
    """`open_page(url, fragment, query, **options)` is `open_hmi` until the end of the test."""
    with ExitStack() as pages:

        def open_one(url: str, fragment: str = "", query: str = "", **options: Any) -> Hmi:
            return pages.enter_context(open_hmi(browser, url, fragment, query, **options))

        yield open_one


@pytest.fixture
def hmi(greenhouse: Bridge, open_page: OpenPage) -> Hmi:
    page = open_page(greenhouse.url)
    page.expect_rows(*TAGS)
    page.expect_samples(3)
    page.expect_layout()
    return page
