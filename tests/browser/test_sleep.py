"""A machine that slept: nothing is live, and nothing has an age, before a fresh state has come."""

from __future__ import annotations

import re

from playwright.sync_api import WebSocketRoute, expect

from tests.browser.hmi import OpenPage
from tests.browser.house import TAGS
from tests.support.web import Bridge

# As on Linux: while the machine sleeps the wall clock goes on, and the monotonic one stands still.
CLOCKS = """
  window.slept = 0;
  const wall = Date.now.bind(Date);
  Date.now = () => wall() + window.slept;
"""


def test_after_a_sleep_no_age_and_no_live_before_a_fresh_state(
    house: Bridge, open_page: OpenPage
) -> None:
    hmi = open_page(house.url, go=False)
    hmi.page.add_init_script(CLOCKS)
    held: list[WebSocketRoute] = []
    is_away = False

    def meet(socket: WebSocketRoute) -> None:
        if is_away:
            held.append(socket)  # it opens, and says nothing
        else:
            socket.connect_to_server()

    hmi.page.route_web_socket(re.compile("/ws/state"), meet)
    hmi.go("tag=1")
    hmi.expect_rows(*TAGS)
    hmi.expect_phase("live")
    ages = hmi.page.locator("tbody .cell-age .age")
    expect(ages.first).to_have_text(re.compile(r"^\d+\s(s|min|h)$"))
    seen = hmi.page.locator("tbody tr[data-tag-id='seen'] .cell-age .age")
    expect(seen).to_have_text("never")

    is_away = True
    hmi.page.evaluate("window.slept = 3600000")
    hmi.expect_phase("reconnecting")
    # Of a tag that no scan has brought a reading of, that much is known.
    expect(ages).to_have_text(["never" if tag in ("failed", "seen") else "unknown" for tag in TAGS])
    expect(hmi.card("1")).to_contain_text("unknown")
    banner = hmi.test_id("frozen")
    expect(banner).to_contain_text("No new readings. Last data at")
    expect(banner).not_to_contain_text("ago")
    hmi.expect(lambda: len(held) > 0, "a new connection")
    # Open alone is not live.
    expect(hmi.app).to_have_attribute("data-fresh", "false")
    expect(ages.first).to_have_text("unknown")

    is_away = False
    held[-1].close()
    hmi.expect_phase("live")
    expect(ages.first).to_have_text(re.compile(r"^\d+\s(s|min|h)$"))
    expect(seen).to_have_text("never")
