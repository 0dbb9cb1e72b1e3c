"""A phone in the hand: drag, pinch, and the two halves of a narrow screen."""

import re
from collections.abc import Sequence

import pytest
from playwright.sync_api import WebSocketRoute, expect

from tests.browser.greenhouse import TAGS
from tests.browser.hmi import PHONE, Hmi, OpenPage
from tests.browser.places import place, places
from tests.support.web import Bridge


@pytest.fixture
def phone(greenhouse: Bridge, open_page: OpenPage) -> Hmi:
    hmi = open_page(greenhouse.url, viewport=PHONE, has_touch=True, is_mobile=True)
    hmi.expect_samples(3)
    hmi.settled_picture()
    return hmi


def drag(hmi: Hmi, *paths: Sequence[tuple[float, float]]) -> None:
    """Fingers that each move along a path of the map view, pixels; all paths have equal lengths."""
    box = hmi.map.bounding_box()
    assert box is not None
    session = hmi.page.context.new_cdp_session(hmi.page)

    def touch(kind: str, points: Sequence[tuple[float, float]]) -> None:
        places = [
            {"x": box["x"] + x, "y": box["y"] + y, "id": index}
            for index, (x, y) in enumerate(points)
        ]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": places})
        # Chromium delivers one move a frame to a page.
        hmi.page.evaluate("new Promise(requestAnimationFrame)")

    for index, points in enumerate(zip(*paths, strict=True)):
        touch("touchMove" if index else "touchStart", points)
    touch("touchEnd", [])
    session.detach()


def show(phone: Hmi, pane: str) -> None:
    """Tap on the name of a half, and wait for it."""
    phone.page.get_by_role("navigation").get_by_role("button", name=pane).tap()
    expect(phone.map).to_be_visible(visible=pane == "Map")
    expect(phone.row("1")).to_be_visible(visible=pane == "Tags")


def test_most_of_the_height_is_content(phone: Hmi) -> None:
    """Not bars: on each tab, and in the card."""
    tall = 0.6 * PHONE["height"]

    def heights(*selectors: str) -> list[float]:
        return [box.bottom - box.top for box in places(phone, *selectors)]

    assert sum(heights(".health-strip", ".map-frame", ".legend")) >= tall
    # The numbers of tags by status, and what to do first: since when, beside how many more.
    counts = phone.page.locator(".strip-counts li")
    expect(counts).to_have_text(["Critical 1", "Stressed 1", "Unknown 2", "Healthy 3"])
    expect(counts.last).to_be_in_viewport(ratio=1)
    more = phone.page.locator(".health-strip .do-more")
    expect(more).to_have_text(re.compile(r"^\+ \d+ more$"))
    expect(phone.page.locator(".health-strip small")).to_be_in_viewport(ratio=1)
    for pane in ("Tags", "Alarms"):
        phone.page.get_by_role("navigation").get_by_role("button", name=pane).tap()
        (panel,) = heights(".tags-panel")
        # The fixed part while the rest scrolls.
        still = sum(heights(*("thead",) if pane == "Tags" else (".alarm-line", ".alarms h3")))
        assert panel - still >= tall, pane
    show(phone, "Tags")
    phone.row("2").tap()
    assert heights(".card")[0] >= tall
    # Its age and its ideal range share a line.
    assert heights(".card-readings li:has(.card-ideal)")[0] < 66
    phone.page.get_by_role("navigation").get_by_role("button", name="Map").tap()
    expect(phone.map).to_be_visible()
    frame, card = heights(".map-frame", ".card")
    assert frame >= 200
    assert frame + card >= tall
    # The legend leaves its title to the sensor above the map, but not the way out of a comparison.
    phone.turn("compare=day")
    expect(phone.page.get_by_role("button", name="Stop comparing")).to_be_in_viewport(ratio=1)
    # Both on one line: the comparison takes as little of the map as it can.

    def are_on_one_line() -> bool:
        end, details = places(phone, ".legend-difference button", ".legend-more summary")
        return details.top < end.bottom and end.top < details.bottom

    phone.expect(are_on_one_line, "one line")
    # On its side, the first task has its limit.
    phone.resize(740, 360)
    why = phone.test_id("health-first")
    phone.expect(lambda: why.evaluate("e => e.scrollWidth <= e.clientWidth"), "all of its words")


def test_a_played_recording_shows_its_time_on_each_tab(phone: Hmi) -> None:
    """Also in German, whose words are longer, and beside a card, where no map is."""

    def of_a_recording(socket: WebSocketRoute) -> None:
        socket.connect_to_server().on_message(
            lambda it: socket.send(re.sub(r'("origin": ?)"\w+"', r'\1"recorded"', str(it)))
        )

    phone.page.route_web_socket(re.compile("/ws/state"), of_a_recording)
    phone.go("tag=2", "?lang=de")
    for tab in phone.page.locator(".pane-tabs button").all():
        tab.tap()
        time = phone.test_id("origin").locator("strong")
        expect(time).to_be_in_viewport(ratio=1)
        expect(time).to_have_text(re.compile(r"\d\d:\d\d:\d\d$"))
        expect(phone.test_id("origin")).to_contain_text("Aufgezeichnet")
    menu = phone.page.get_by_role("button", name="Menü")
    expect(menu).to_be_in_viewport(ratio=1)


def test_charts_are_whole_and_have_one_line_of_tools_and_the_whole_width(phone: Hmi) -> None:
    phone.go("chart.tag=10&tag=10", "?lang=nl")
    menu = phone.page.get_by_role("combobox", name="Meetpunten")
    expect(menu).to_have_value("10")
    # An iPhone would zoom to smaller text.
    expect(menu).to_have_css("font-size", "16px")

    # One has room: whole, above the title of the next.
    phone.resize(360, 560)
    plots = phone.test_id("plot")
    expect(plots).to_have_count(5)

    def are_whole() -> bool:
        edge = place(phone.page.locator(".chart-body")).bottom
        return place(plots.first).bottom < edge <= place(plots.nth(1)).top + 1

    phone.expect(are_whole, "no chart that the edge cuts")
    phone.resize(**PHONE)
    head = phone.page.locator(".chart-view > header")
    # More lines until its styles and all its parts are there.
    phone.expect(lambda: place(head).bottom - place(head).top < 60, "one line of tools")
    phone.turn("chart.sensor=1&chart.sensor=10&sensor=dew_point")
    expect(phone.page.locator(".chart-tags li")).to_have_count(2)
    expect(phone.page.locator(".u-over")).to_be_visible()
    # Another tag can be chosen without scrolling, above the line of those in the chart.
    add, tags, inside = places(
        phone, ".chart-tags > select:last-of-type", ".chart-tags ul", ".u-over"
    )
    assert add.right < PHONE["width"]
    assert add.bottom < tags.top
    assert tags.bottom - tags.top < 40
    assert inside.right > PHONE["width"] - 30
    # Names of limits are inside a narrow plot.
    phone.turn("chart.tag=1&tag=1")
    expect(phone.page.locator(".chart-tags")).to_have_count(0)
    expect(plots.first.locator(".u-over")).to_be_visible()
    assert place(plots.first.locator(".u-over")).right > PHONE["width"] - 30


def test_one_finger_moves_the_map_and_two_zoom_about_their_middle(phone: Hmi) -> None:
    before = phone.view()
    drag(phone, [(150 + 10 * step, 150 + 5 * step) for step in range(5)])

    def moved() -> bool:
        after = phone.view()
        return (after.x - before.x, after.y - before.y) == pytest.approx((40, 20), abs=1)

    phone.expect(moved, "a map that followed the finger")
    assert phone.view().scale == before.scale

    before = phone.view()
    middle = before.pixel(2, 2)
    x, y = middle
    reaches = (40, 50, 60, 70, 80)
    drag(phone, [(x - reach, y) for reach in reaches], [(x + reach, y) for reach in reaches])
    twice = pytest.approx(before.scale * 2, rel=0.02)
    phone.expect(lambda: phone.view().scale == twice, "twice the scale")
    assert phone.view().pixel(2, 2) == pytest.approx(middle, abs=2)
    # The page itself did not zoom with it.
    assert phone.page.evaluate("visualViewport.scale") == 1


def test_a_narrow_screen_shows_one_half_at_a_time_large_enough_for_a_finger(phone: Hmi) -> None:
    expect(phone.map).to_be_visible()
    expect(phone.row("1")).to_be_hidden()
    show(phone, "Tags")
    phone.expect_rows(*TAGS)
    # A value whose column is hidden stays in the reason.
    expect(phone.row("10").locator(".why")).to_contain_text(re.compile(r"Humidity 40\.0.*above 26"))
    for pane in ("Tags", "Map"):
        show(phone, pane)
        assert phone.page.evaluate("document.documentElement.scrollWidth") == PHONE["width"]
    phone.colour_by_value()
    for pane in ("Map", "Tags"):
        show(phone, pane)
        # WCAG 2.2, 2.5.5, as phones recommend; a text link among them is as high.
        small = phone.page.evaluate(
            """() => [...document.querySelectorAll('button, a, label, select, input')]
              .filter((e) => e.checkVisibility() && !e.closest('.unseen, .skip, .row-button'))
              .filter((e) => !(e.tagName === 'INPUT' && e.closest('label')))
              .map((e) => [e, e.getBoundingClientRect()])
              .filter(([, box]) => box.width > 0 && (box.width < 44 || box.height < 44))
              .map(([e, box]) => `${e.textContent || e.ariaLabel} ${box.width}x${box.height}`)"""
        )
        assert small == []
    # The whole row reacts, not only the few letters of its id.
    box = phone.row("2").bounding_box()
    assert box is not None
    assert box["height"] >= 40
    phone.row("2").tap(position={"x": 200, "y": box["height"] / 2})
    expect(phone.row("2")).to_have_attribute("data-selected", "true")
