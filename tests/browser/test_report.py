"""The shift report: opened from the menu, and on paper."""

from __future__ import annotations

import math
import re
import time
from collections.abc import Iterator
from functools import partial
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, ViewportSize, expect

from tests.browser.hmi import FONTS, OpenPage
from tests.browser.places import LINES, place
from tests.support.messages import inspection, scan
from tests.support.waiting import wait_for
from tests.support.web import Bridge, bridge

# Names that a robot may send.
LONG = "a" * 200
HOSTILE = "<script>document.title = 'owned'</script>"
TAGS = (*(f"tag {number}" for number in range(60)), LONG, HOSTILE)
# The space of A4 between the margins of the page, and the page between, CSS pixels.
A4_PX = round(186 / 25.4 * 96)


@pytest.fixture(scope="module")
def troubled(browser: Browser) -> Iterator[Bridge]:  # created before the page
    """A greenhouse with more alarms than a sheet of paper holds."""
    with bridge() as running:
        running.peer.wait_for_twin()
        for number, tag_id in enumerate(TAGS, start=1):
            running.peer.observe(
                scan(tag_id, {"temperature": 21.5, "humidity": 60.0, "a" * 100: 1e300})
            )
            running.peer.observe(inspection(tag_id, anomaly=True, bug_count=3))
            if number % 20 == 0:  # no queue has room for all
                wait_for(partial(has_tags, running, number), "tags")
        for _ in range(2):
            running.peer.observe(scan(TAGS[0], {"humidity": 5.0}))
        raised = len(TAGS) + 1
        wait_for(lambda: counts(running)["raised"] == raised, "the alarms in the report")
        # A report ends with a whole second; the page's latest state may be a second old.
        end_s = math.floor(time.time()) + 2
        wait_for(lambda: time.time() >= end_s, "the seconds to be over")
        yield running


def has_tags(running: Bridge, count: int) -> bool:
    return len(running.json("/api/state")["tags"]) >= count


def counts(running: Bridge) -> dict[str, Any]:
    answer = running.http.get("/api/report")
    found: dict[str, Any] = answer.json()["counts"] if answer.status_code == 200 else {"raised": 0}
    return found


def printed(open_page: OpenPage, address: str) -> Page:
    page = open_page(address, go=False, viewport={"width": A4_PX, "height": 1000}).page
    page.goto(address)
    page.emulate_media(media="print")
    return page


def test_the_menu_opens_the_report_of_the_period_on_the_time_bar(
    troubled: Bridge, open_page: OpenPage
) -> None:
    hmi = open_page(troubled.url, query="?lang=de")
    hmi.page.get_by_role("button", name=re.compile("^Menü")).click()
    with hmi.page.context.expect_page() as opened:
        hmi.page.get_by_role("link", name="Schichtbericht").click()
    page = opened.value
    expect(page.get_by_role("heading", level=1)).to_have_text("Schichtbericht")
    query = dict(re.findall(r"[?&]([a-z]+)=([^&]*)", page.url))
    assert int(query["to"]) - int(query["from"]) == 8 * 3_600
    assert page.locator("html").get_attribute("lang") == "de"
    expect(page.get_by_role("columnheader", name="Schlimmster Wert")).to_be_visible()
    assert page.evaluate(FONTS) == ["loaded"]


@pytest.mark.parametrize("lang", ["en", "de", "nl", "es"])
def test_nothing_is_cut_on_paper_and_names_are_text(
    troubled: Bridge, open_page: OpenPage, lang: str
) -> None:
    page = printed(open_page, f"{troubled.url}/api/report.html?lang={lang}")
    assert "owned" not in page.title()
    expect(page.get_by_text(HOSTILE).first).to_be_visible()
    wide = page.evaluate(
        "[...document.querySelectorAll('body *')].map("
        "it => it.getBoundingClientRect().right).reduce((a, b) => Math.max(a, b))"
    )
    assert wide <= A4_PX + 1
    assert page.evaluate("document.documentElement.scrollWidth") <= A4_PX
    head = page.locator("thead").first
    assert head.evaluate("it => getComputedStyle(it).display") == "table-header-group"
    row = page.locator("tbody tr").first
    assert row.evaluate("it => getComputedStyle(it).breakInside") == "avoid"
    paper = page.pdf(prefer_css_page_size=True)
    sheets = re.findall(rb"/MediaBox \[([^\]]*)\]", paper)
    assert len(sheets) > 2
    # A4, points.
    assert {tuple(round(float(side)) for side in box.split()) for box in sheets} == {
        (0, 0, 595, 842)
    }
    assert page.locator("script").count() == 0


def test_on_a_dark_phone_it_is_light_and_only_a_wide_table_scrolls(
    troubled: Bridge, browser: Browser
) -> None:
    phone: ViewportSize = {"width": 390, "height": 844}
    with browser.new_context(viewport=phone, color_scheme="dark") as context:
        page = context.new_page()
        page.goto(f"{troubled.url}/api/report.html")
        assert page.evaluate("document.documentElement.scrollWidth") == 390
        left = [place(it).left for it in page.locator("dt").all()]
        assert left[0] == left[2] < left[1] == left[3], "two in a row"
        limits = page.locator("table.alarms td", has_text=re.compile(r"\d\sto\s.*%"))
        assert limits.evaluate_all(f"all => all.map({LINES})") == [1]
        colour = page.locator("body").evaluate("it => getComputedStyle(it).backgroundColor")
        assert colour == "rgb(255, 255, 255)"


def test_on_a_phone_an_alarm_has_room(greenhouse: Bridge, browser: Browser) -> None:
    with browser.new_context(viewport={"width": 390, "height": 844}) as context:
        page = context.new_page()
        page.goto(f"{greenhouse.url}/api/report.html?lang=nl")
        hidden = "table => table.scrollWidth - table.clientWidth"
        assert [it.evaluate(hidden) for it in page.locator("table.alarms").all()] == [0]
        # Words of neighbouring columns do not read as one.
        words = """([one, next]) => {
          const range = document.createRange();
          const box = (it) => (range.selectNodeContents(it), range.getBoundingClientRect());
          return box(next).left - box(one).right; }"""
        names = page.locator("table.alarms th").element_handles()[1:3]
        assert page.evaluate(words, names) >= 12
