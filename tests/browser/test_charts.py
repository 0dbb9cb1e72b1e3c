"""Charts and the difference layer, compared with the API's answers about the same past."""

import csv
import io
import math
import re
import time
from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any, Final
from urllib.parse import parse_qsl, urlsplit

import numpy as np
import pytest
from lupin_msgs.msg import Observation
from PIL import Image
from playwright.sync_api import Locator, expect

from tests.browser.hmi import PHONE, WIDE, Hmi, OpenPage
from tests.browser.places import place, places
from tests.support.messages import inspection, scan, set_stamp
from tests.support.waiting import wait_for
from tests.support.web import Bridge, bridge

STEP_S: Final = 60.0
MANY: Final = 420
# Of the 50 that the latch holds.
LOT: Final = 40
# Temperature's colour as the style sheet darkens it, light.
LINE: Final = (186, 51, 31)


# What is written into pictures.
WATCH_TEXTS: Final = """const paint = CanvasRenderingContext2D.prototype.fillText;
window.texts = []; CanvasRenderingContext2D.prototype.fillText = function (text, ...place) {
  texts.push(text); return paint.call(this, text, ...place); };"""


class Garden:
    """Two hours of tag 1 with twenty minutes missing; of tag 2 more than a chart has points."""

    def __init__(self, running: Bridge) -> None:
        self.bridge = running
        self.now_s = time.time()
        self.from_s = round(self.now_s - 7200, 3)
        self.gap_s = (self.now_s - 3600, self.now_s - 2400)
        running.peer.wait_for_twin()
        first = [
            scan("1", {"temperature": 22 + 3 * math.sin(index / 12), "co2": 600.0}, at=(1, 1))
            for index in range(118)
        ]
        for index, message in enumerate(first):
            set_stamp(message.header, self.now_s - 7100 + index * STEP_S)
        self.far = [
            message
            for message in first
            if not self.gap_s[0] < message.header.stamp.sec < self.gap_s[1]
        ]
        self._observe("1", self.far)
        self._observe(
            "2",
            [
                scan(
                    "2",
                    {"temperature": 20 + 4 * math.sin(index / 9)},
                    at=(3, 1),
                    stamp_s=self.now_s - 7000 + index * 16,
                )
                for index in range(MANY)
            ],
        )
        running.peer.observe(
            scan("1", status=Observation.STATUS_SCAN_FAILED, at=(1, 1), stamp_s=self.now_s - 4990),
            inspection("1", "lupin", stamp_s=self.now_s - 4500),
        )
        running.tag("1", lambda tag: tag["species"] == "lupin")

    def _observe(self, tag_id: str, messages: Sequence[Any]) -> None:
        """As many at once as the latch holds, each batch once the one before is stored."""
        for start in range(0, len(messages), LOT):
            lot = messages[start : start + LOT]
            self.bridge.peer.observe(*lot)
            until = start + len(lot)
            wait_for(partial(self._remembers, tag_id, until), f"{until} readings of tag {tag_id}")

    def _remembers(self, tag_id: str, count: int) -> bool:
        body = self.history(tag_id=tag_id, sensor_type="temperature", points="5000")
        return len(body["readings"]) == count

    def history(self, **query: str) -> Any:
        return self.bridge.json("/api/history", **query)

    @property
    def period(self) -> str:
        return f"period={self.from_s},{round(self.now_s, 3)}"


@pytest.fixture(scope="module")
def garden() -> Iterator[Garden]:
    with bridge() as running:
        yield Garden(running)


def queries(hmi: Hmi) -> list[dict[str, str]]:
    return [dict(parse_qsl(urlsplit(url).query)) for url in hmi.requests if "/api/history?" in url]


def requested(hmi: Hmi, sensor: str = "temperature") -> dict[str, str]:
    return [each for each in queries(hmi) if each["sensor_type"] == sensor][-1]


def plot(hmi: Hmi) -> Locator:
    return hmi.page.get_by_role("region", name="Chart of Temperature").get_by_test_id("plot")


def plotted(hmi: Hmi) -> Image.Image:
    """The inside of the first chart, once it is there."""
    inside = plot(hmi).locator(".u-over")
    expect(inside).to_be_visible()
    hmi.expect(lambda: bool(columns(inside)), "a line in the chart")
    return Image.open(io.BytesIO(inside.screenshot())).convert("RGB")


def columns(inside: Locator, colour: Sequence[int] = LINE) -> list[int]:
    return line_columns(Image.open(io.BytesIO(inside.screenshot())).convert("RGB"), colour)


def line_columns(picture: Image.Image, colour: Sequence[int] = LINE) -> list[int]:
    """The columns with pixels of the line's own colour."""
    pixels = np.asarray(picture, dtype=int)
    near = np.abs(pixels - np.array(colour)).sum(axis=2) < 90
    return [int(column) for column in np.flatnonzero(near.any(axis=0))]


def rows(hmi: Hmi) -> list[dict[str, str]]:
    """The table's rows: their kind, their time and their cells."""
    found = (
        hmi.page.get_by_test_id("series-table")
        .locator("tbody tr")
        .evaluate_all(
            """rows => rows.map(row => ({
          kind: row.dataset.kind, at: row.dataset.at,
          text: [...row.cells].map(cell => cell.textContent).join('|'),
        }))"""
        )
    )
    assert isinstance(found, list)
    return found


def test_a_gap_stays_open_and_the_table_equals_the_api(garden: Garden, open_page: OpenPage) -> None:
    hmi = open_page(garden.bridge.url, f"chart.tag=1&{garden.period}")
    picture = plotted(hmi)
    share = picture.width / (garden.now_s - garden.from_s)
    drawn = line_columns(picture)
    # A marker is six pixels wide.
    left, right = ((at - garden.from_s) * share for at in garden.gap_s)
    assert [column for column in drawn if left + 6 < column < right - 6] == []
    inside = [column for column in drawn if 20 < column < left - 10]
    assert len(inside) > 0.9 * (left - 30)

    reported = garden.history(**requested(hmi))
    assert not reported["is_bucketed"]
    assert len(reported["gaps"]) == 1
    summary = plot(hmi).get_attribute("aria-label") or ""
    assert f"{len(reported['readings'])} readings" in summary
    assert "1 gap" in summary
    hmi.page.get_by_role("button", name="Show as table").click()
    expect(hmi.test_id("series-table")).to_be_visible()
    found = rows(hmi)
    readings = [row for row in reversed(found) if row["kind"] == "reading"]
    assert [float(row["at"]) for row in readings] == [
        pytest.approx(each["stamp"]["sec"] + each["stamp"]["nanosec"] / 1e9)
        for each in reported["readings"]
    ]
    for row, each in zip(readings, reported["readings"], strict=True):
        assert f"|{each['value']:.1f}\u00a0°C|" in row["text"]
    kinds = [row["kind"] for row in found]
    assert (kinds.count("gap"), kinds.count("failure"), kinds.count("inspection")) == (1, 1, 1)
    assert any("no data for" in row["text"] for row in found if row["kind"] == "gap")


def test_many_come_in_buckets_and_a_drag_brings_readings(
    garden: Garden, open_page: OpenPage
) -> None:
    # A wider chart has room for each of them.
    narrow = {"width": 800, "height": 900}
    hmi = open_page(garden.bridge.url, f"chart.tag=2&{garden.period}", viewport=narrow)
    picture = plotted(hmi)
    reported = garden.history(**requested(hmi))
    assert reported["is_bucketed"]
    whole = plot(hmi).get_attribute("aria-label") or ""
    inside = plot(hmi).locator(".u-over")
    box = inside.bounding_box()
    assert box is not None
    y = box["y"] + 40
    hmi.page.mouse.move(box["x"] + 0.6 * picture.width, y)
    hmi.page.mouse.down()
    hmi.page.mouse.move(box["x"] + 0.75 * picture.width, y, steps=5)
    hmi.page.mouse.up()
    hmi.expect(lambda: float(requested(hmi)["from"]) > garden.from_s + 60, "a finer query")
    finer = garden.history(**requested(hmi))
    assert not finer["is_bucketed"]
    span_s = garden.now_s - garden.from_s
    assert float(requested(hmi)["from"]) == pytest.approx(
        garden.from_s + 0.6 * span_s, abs=0.02 * span_s
    )
    hmi.expect(lambda: "period=" in hmi.address(), "the link to follow")
    expect(plot(hmi)).not_to_have_attribute("aria-label", whole)
    hmi.page.get_by_role("button", name="Whole period").click()
    # The shown range, not the requested one: the old answer stays until the next arrives.
    expect(plot(hmi)).to_have_attribute("aria-label", whole)
    with hmi.page.expect_download() as download:
        hmi.page.get_by_role("button", name="CSV of this view").click()
    text = download.value.path().read_text(encoding="utf-8-sig")
    table = list(csv.DictReader(io.StringIO(text)))
    buckets = [row for row in table if row["kind"] == "bucket"]
    assert [int(row["n"]) for row in buckets] == [bucket["n"] for bucket in reported["buckets"]]
    assert [float(row["value"]) for row in buckets] == [
        pytest.approx(bucket["mean"]) for bucket in reported["buckets"]
    ]
    link = hmi.test_id("export-link").get_attribute("href") or ""
    exported = garden.bridge.http.get(link).text.splitlines()
    assert len(exported) == 1 + MANY


def test_hover_shows_the_time_and_a_click_goes_there(garden: Garden, open_page: OpenPage) -> None:
    hmi = open_page(garden.bridge.url, f"tag=1&{garden.period}")
    expect(hmi.test_id("card-chart")).to_be_visible()
    hmi.page.keyboard.press("c")
    picture = plotted(hmi)
    # The whole page, but for the first thing to do.
    charts = place(hmi.test_id("chart-view"))
    assert charts.right - charts.left > WIDE["width"] - 4
    expect(hmi.row("1")).to_be_hidden()
    expect(hmi.test_id("tag-card")).to_be_hidden()
    expect(hmi.test_id("health-strip")).to_be_visible()
    # The row or card that led here is out of sight: the keyboard goes on in the charts.
    expect(hmi.test_id("chart-view")).to_be_focused()
    inside = plot(hmi).locator(".u-over")
    inside.hover(position={"x": picture.width * 0.25, "y": 30})
    expect(hmi.page.locator(".plot-time").first).to_have_text(re.compile(r"\d\d:\d\d:\d\d"))
    inside.click(position={"x": picture.width * 0.25, "y": 30})
    hmi.expect(lambda: "at=" in hmi.address(), "a moment in the link")
    at = float(dict(parse_qsl(urlsplit(hmi.address()).fragment))["at"])
    quarter = garden.from_s + 0.25 * (garden.now_s - garden.from_s)
    assert at == pytest.approx(quarter, abs=60)
    # Another tag without the list; and the way back to it.
    choice = hmi.page.get_by_role("combobox", name="Tags")
    choice.select_option("2")
    expect(plot(hmi)).to_have_attribute("aria-label", re.compile("Tag 2:"))
    hmi.page.keyboard.press("Escape")
    expect(hmi.test_id("chart-view")).to_have_count(0)
    expect(hmi.card("2").get_by_role("button", name="Charts", exact=True)).to_be_focused()


def test_the_day_before_is_compared_and_the_axis_is_in_the_pages_language(
    garden: Garden, open_page: OpenPage
) -> None:
    now_s = time.time()
    scans = (
        scan("6", {"light": 20_000.0 - ago_s / 100}, at=(5, 1), stamp_s=now_s - ago_s)
        for ago_s in (86_400 + 1_500, 1_500, 1_000)
    )
    garden.bridge.peer.observe(*scans)
    garden.bridge.tag("6", lambda tag: tag["readings"][0]["value"] == 19_990.0)
    hmi = open_page(garden.bridge.url, go=False)
    hmi.page.add_init_script(WATCH_TEXTS)
    hmi.go(f"chart.tag=6&period={now_s - 3_600:.3f},{now_s:.3f}", "?lang=nl")
    legend = hmi.page.locator(".line-value")
    expect(legend).to_have_text(re.compile("19"))
    thousands = "texts.some((text) => /^\\d\\d\\.\\d{3}$/.test(text))"
    hmi.expect(lambda: bool(hmi.page.evaluate(thousands)), "thousands as in Dutch")
    hmi.page.get_by_role("button", name="Dag ervoor").click()
    expect(legend).to_contain_text("dag ervoor")
    hmi.page.reload()
    expect(legend).to_contain_text("dag ervoor")


def test_on_a_phone_the_card_makes_room_for_its_charts(garden: Garden, open_page: OpenPage) -> None:
    hmi = open_page(garden.bridge.url, f"tag=1&{garden.period}", viewport=PHONE)
    card = hmi.test_id("tag-card")
    tab = hmi.page.locator(".pane-tabs").get_by_role("button", name="Tags")
    tab.click()
    charts = card.get_by_role("button", name="Charts", exact=True)
    charts.click()
    expect(hmi.test_id("chart-view")).to_be_visible()
    expect(card).to_be_hidden()
    # Without room for all charts they scroll, and each is high enough to be read.
    hmi.resize(360, 600)
    inside = plot(hmi).locator(".u-over")
    hmi.expect(lambda: place(inside).bottom > place(inside).top + 100, "a chart to be read")
    hmi.resize(**PHONE)
    hmi.test_id("chart-view").get_by_role("button", name="Close").click()
    # Back to where it was opened, not to the map or the top of the card.
    expect(card).to_be_visible()
    expect(tab).to_have_attribute("aria-pressed", "true")
    expect(charts).to_be_focused()
    expect(hmi.test_id("card-chart")).to_be_in_viewport()
    # Elsewhere the chart's line of facts shares that of its choice.
    hmi.resize(**WIDE)
    expect(hmi.page.locator(".card-chart header")).to_be_visible()
    choice, facts = places(hmi, ".card-chart > select", ".card-chart header")
    assert (choice.right <= facts.left, facts.bottom) == (True, choice.bottom)


def test_each_of_several_tags_has_the_colour_of_its_name(
    garden: Garden, open_page: OpenPage
) -> None:
    hmi = open_page(garden.bridge.url, f"chart.tag=1&{garden.period}")
    plotted(hmi)
    hmi.page.get_by_role("button", name="Several tags").click()
    inside = plot(hmi).locator(".u-over")
    signs = hmi.page.locator(".line-sign")
    expect(signs).to_have_count(1)
    drawn = signs.evaluate("sign => getComputedStyle(sign).color")
    colour = [int(part) for part in re.findall(r"\d+", drawn)]
    hmi.expect(lambda: bool(columns(inside, colour)), f"a line in {colour}")
    assert not columns(inside)
