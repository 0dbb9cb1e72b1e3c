"""What leaves the page: links, CSV, PNG, paper, and the shift report."""

from __future__ import annotations

import io
import math
import re
import time
from collections.abc import Iterator
from functools import partial
from typing import Any

import pytest
from PIL import Image, ImageStat
from playwright.sync_api import Browser, Download, Page, ViewportSize, expect

from tests.browser.greenhouse import TAGS
from tests.browser.hmi import FONTS, PHONE, Hmi, OpenPage, changed_box
from tests.browser.places import place, places
from tests.support.messages import inspection, scan
from tests.support.waiting import wait_for
from tests.support.web import Bridge, bridge


def save(hmi: Hmi, name: str) -> Download:
    """Choose an entry of the menu that saves a file, once the sensors' own names are loaded."""
    expect(hmi.test_id("legend")).to_contain_text("Temperature °C")
    hmi.page.get_by_role("button", name="Menu").click()
    with hmi.page.expect_download() as download:
        hmi.page.get_by_role("button", name=name).click()
    return download.value


FOOTER_PX = 56


def is_on_the_screen(hmi: Hmi, part: Image.Image, at: tuple[int, int], ratio: int) -> bool:
    """Whether that part of the map is there, `at` in pixels of the map view."""
    box = hmi.map.bounding_box()
    assert box is not None
    left, top = round(box["x"] * ratio) + at[0] * ratio, round(box["y"] * ratio) + at[1] * ratio
    screen = Image.open(io.BytesIO(hmi.page.screenshot())).convert("RGB")
    shown = screen.crop((left, top, left + part.width, top + part.height))
    return changed_box(shown, part) is None


def test_the_map_as_png_equals_the_screen(greenhouse: Bridge, open_page: OpenPage) -> None:
    for options, ratio in (({}, 1), ({"device_scale_factor": 2, "viewport": PHONE}, 2)):
        hmi = open_page(greenhouse.url, "colour=value&layers=map,field,boxes", **options)
        hmi.expect_samples(3)
        hmi.settled_picture()
        download = save(hmi, "Save map as PNG")
        assert download.suggested_filename.endswith(".png")
        picture = Image.open(download.path()).convert("RGB")
        box = hmi.map.bounding_box()
        assert box is not None
        height = math.ceil(box["height"]) + FOOTER_PX
        assert picture.size == (math.ceil(box["width"]) * ratio, height * ratio)
        # The same to the pixel, where no button or legend covers it. The pointer is where
        # the menu was, above a row, whose tag has a ring on the screen alone: move it away.
        hmi.page.mouse.move(0, 0)
        hmi.settled_picture()
        view = hmi.view()
        (x0, y0), (x1, y1) = view.pixel(0.2, 4.2), view.pixel(3.8, 1.0)
        saved = picture.crop((x0 * ratio, y0 * ratio, x1 * ratio, y1 * ratio))
        hmi.expect(partial(is_on_the_screen, hmi, saved, (x0, y0), ratio), "what was saved")
        assert len(saved.getcolors(1 << 20) or []) > 50
        footer = picture.crop((0, picture.height - FOOTER_PX * ratio, *picture.size))
        # Its words: what the colours show, and of when.
        assert len(footer.getcolors(1 << 20) or []) > 5


def luminance(pixel: object) -> float:
    assert isinstance(pixel, tuple)
    return float(sum(pixel) / len(pixel))


def typical_luminance(picture: Image.Image) -> float:
    """That of most of a map: of its ground and floor."""
    return float(ImageStat.Stat(picture.convert("L")).median[0])


A4: ViewportSize = {"width": 702, "height": 1032}  # without the margins, CSS pixels
# The page's visible controls, except buttons that are content: a row, a tag, a status.
CONTROLS = """[...document.querySelectorAll('button, input, select, summary, [role=slider]')]
    .filter(it => it.checkVisibility({ visibilityProperty: true }))
    .filter(it => !it.matches('thead *, .row-button, [data-tag-id], [data-health]'))
    .map(it => it.outerHTML)"""
# Drawn names of columns: a sheet repeats a header group whose cells stay in it.
HEAD = """[...document.querySelectorAll('.tags thead, .tags thead th')]
    .filter(it => it.checkVisibility())
    .map(it => getComputedStyle(it))
    .map(it => `${it.display} ${it.position}`)"""
# The property of a cell, or of its content, that hides a part of its words.
CUT = """it => [it, ...it.closest('td').querySelectorAll('*'), it.closest('td')]
    .filter(each => getComputedStyle(each).overflow !== 'visible' && !each.matches('.unseen'))
    .filter(each => each.scrollWidth > each.clientWidth || each.scrollHeight > each.clientHeight)
    .map(each => each.outerHTML)"""


def test_paper_has_every_row_and_its_time_and_is_light(
    greenhouse: Bridge, open_page: OpenPage
) -> None:
    # Where the floor is most of the picture, and the coloured field is not.
    hmi = open_page(greenhouse.url, "view=2,2,20", color_scheme="dark")
    hmi.expect_rows(*TAGS)
    hmi.expect_samples(3)
    hmi.expect_map()
    line = hmi.test_id("paper-line")
    expect(line).to_be_hidden()
    (frame,) = places(hmi, ".map-frame")
    proportion = (frame.right - frame.left) / (frame.bottom - frame.top)
    assert typical_luminance(hmi.settled_picture()) < 60

    # As a browser does before printing.
    hmi.page.emulate_media(media="print")
    hmi.page.evaluate("dispatchEvent(new Event('beforeprint'))")
    expect(hmi.row("seen")).to_be_visible()
    screen = hmi.page.viewport_size
    hmi.page.set_viewport_size(A4)
    expect(hmi.page.get_by_role("button", name="Menu")).to_be_hidden()
    expect(hmi.page.locator(".connection")).to_be_hidden()
    moment = r"\d{1,2} \w+ \d{4}, \d\d:\d\d:\d\d"
    # The greenhouse follows /clock.
    taken = rf"^As of {moment} \(Simulated time\), printed {moment}$"
    expect(line).to_have_text(re.compile(taken))
    expect(line).to_be_visible()
    expect(hmi.test_id("ideal-scale")).to_be_visible()
    # The canvases are those of the screen: in another shape, round pins would be oval.
    (frame,) = places(hmi, ".map-frame")
    assert frame.right <= A4["width"]
    assert (frame.right - frame.left) / (frame.bottom - frame.top) == pytest.approx(
        proportion, rel=0.01
    )
    # Chromium paints no button in a heading that it repeats.
    expect(hmi.page.locator("thead button").first).to_have_css("display", "contents")
    assert hmi.page.evaluate(CONTROLS) == []
    assert set(hmi.page.evaluate(HEAD)) == {"table-header-group static", "table-cell static"}
    # All reasons, where the screen has a line of them and the number of the others.
    reasons = "Air too dry: VPD 2.70 kPa; 3 pests seen; Temperature above 26.0"
    why = hmi.row("10").locator(".why")
    expect(why).to_have_text(reasons, use_inner_text=True)
    expect(why.locator(".why-count")).to_be_hidden()
    assert why.evaluate(CUT) == []
    # Fifty rows a sheet: on paper, none needs a finger's height.
    assert place(hmi.row("2")).bottom - place(hmi.row("2")).top < 30
    assert screen is not None
    hmi.page.set_viewport_size(screen)
    # In a PDF each canvas must be a group of its own, or the clearing of one whitens those below.
    alone = "each => each.every(canvas => getComputedStyle(canvas).opacity === '0.999')"
    assert hmi.page.locator(".map-view canvas").evaluate_all(alone)
    ground = hmi.page.evaluate("getComputedStyle(document.body).backgroundColor")
    assert luminance(tuple(int(part) for part in re.findall(r"\d+", ground))) > 200
    assert typical_luminance(hmi.settled_picture()) > 200

    hmi.page.evaluate("dispatchEvent(new Event('afterprint'))")
    hmi.page.emulate_media(media="screen")
    expect(hmi.page.locator("html")).to_have_attribute("data-theme", "dark")
    assert len(hmi.page.pdf(format="A4")) > 10_000


# Names that a robot may send.
LONG = "a" * 200
HOSTILE = "<script>document.title = 'owned'</script>"
TROUBLED = (*(f"tag {number}" for number in range(60)), LONG, HOSTILE)
# The space of A4 between the margins of the page, and the page between, CSS pixels.
A4_PX = round(186 / 25.4 * 96)


@pytest.fixture(scope="module")
def troubled(browser: Browser) -> Iterator[Bridge]:  # created before the page
    """A greenhouse with more alarms than a sheet of paper holds."""
    with bridge() as running:
        running.peer.wait_for_twin()
        for number, tag_id in enumerate(TROUBLED, start=1):
            running.peer.observe(
                scan(tag_id, {"temperature": 21.5, "humidity": 60.0, "a" * 100: 1e300})
            )
            running.peer.observe(inspection(tag_id, anomaly=True, bug_count=3))
            if number % 20 == 0:  # no queue has room for all
                wait_for(partial(has_tags, running, number), "tags")
        for _ in range(2):
            running.peer.observe(scan(TROUBLED[0], {"humidity": 5.0}))
        raised = len(TROUBLED) + 1
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
    from_s = int(time.time()) - 86_400  # of two days, a time has its date
    with browser.new_context(viewport=phone, color_scheme="dark") as context:
        page = context.new_page()
        page.goto(f"{troubled.url}/api/report.html?from={from_s}")
        assert page.evaluate("document.documentElement.scrollWidth") == 390
        left = [place(it).left for it in page.locator("dt").all()]
        assert left[0] == left[2] < left[1] == left[3], "two in a row"
        colour = page.locator("body").evaluate("it => getComputedStyle(it).backgroundColor")
        assert colour == "rgb(255, 255, 255)"
        # Below a heading a time is the second cell: it stays whole, as the names above may not.
        lines = """cells => cells.map((it) => {
          const range = document.createRange();
          range.selectNodeContents(it);
          return range.getClientRects().length; })"""
        times = page.locator("table.alarms [colspan] + td")
        assert set(times.evaluate_all(lines)) == {1}


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
