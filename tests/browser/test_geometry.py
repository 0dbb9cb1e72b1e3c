"""Positions, by pixel: the field upright, pins on their cells."""

import colorsys
import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import Point, Pose
from playwright.sync_api import expect

import lupin_bridge
from tests.browser.hmi import Hmi, OpenPage, Pixel
from tests.browser.places import expect_in_reach, places
from tests.support.messages import occupancy_grid, scan
from tests.support.web import Bridge, bridge

SENSORS: Any = json.loads((Path(lupin_bridge.__file__).parent / "sensors.json").read_text())


# The bodies of pins in the light theme.
HEALTHY, CRITICAL = (31, 122, 69), (196, 33, 26)
# The colour of occupied cells.
WALL = (84, 94, 88)


def colour_of(sensor: str) -> Pixel:
    """A sensor's colour, computed here again from its declaration."""
    declared = SENSORS["sensors"][sensor]
    parts = colorsys.hls_to_rgb(
        declared["hue"] / 360, declared["lightness"] / 100, SENSORS["ramp"]["saturation"] / 100
    )
    red, green, blue = (round(255 * part) for part in parts)
    return red, green, blue


def over(base: Pixel, sensor: str, share: float) -> Pixel:
    """The heat map's colour for that share of the range, over a base."""
    alpha = SENSORS["ramp"]["max_alpha"] * share
    mixed = (round(b + alpha * (c - b)) for b, c in zip(base, colour_of(sensor), strict=True))
    red, green, blue = mixed
    return red, green, blue


def close(a: Pixel, b: Pixel, most: int = 3) -> bool:
    return max(abs(x - y) for x, y in zip(a, b, strict=True)) <= most


HOT = (4.0, 3.0)
COLD = ((0.0, 0.0), (4.0, 0.0), (0.0, 3.0))


def hot_corner(running: Bridge) -> None:
    """Four tags too far apart to mix: three cold ones, and a hot one at large x and large y."""
    running.peer.publish_map(
        occupancy_grid([[0] * 8] * 7, origin=Pose(position=Point(x=-2.0, y=-2.0)))
    )
    for index, at in enumerate(COLD):
        running.peer.observe(scan(f"cold{index}", {"temperature": 10.0}, at=at))
    running.peer.observe(scan("hot", {"temperature": 30.0}, at=HOT))


VIEW = "view=2,1.5,7"


def test_an_unknown_cell_shows_the_map_below_it(domain: int, open_page: OpenPage) -> None:
    with bridge(domain=domain) as running:
        hot_corner(running)
        # A wall through the middle, farther than 1.5 m from every tag.
        rows = [[0] * 8 for _ in range(7)]
        rows[3][4] = 100
        running.peer.publish_map(occupancy_grid(rows, origin=Pose(position=Point(x=-2.0, y=-2.0))))
        running.tag("hot")
        # The range begins far below the other values, so that each of them has a colour, and so
        # would a zero in a cell's place.
        running.peer.observe(scan("coldest", {"temperature": -30.0}, at=(5.8, -1.8)))
        running.tag("coldest")
        hmi = open_page(running.url, f"{VIEW}&colour=value&layers=map,field")
        hmi.expect_samples(5)
        wall, free, corner = (2.5, 1.5), (2.5, 0.5), (-1.4, -1.4)
        known = [(0.5, 0.5), (4.5, 3.5), (0.5, 3.5), (4.5, 0.5)]
        shares = [40 / 60, 1.0, 40 / 60, 40 / 60]
        hmi.expect_map()
        hmi.expect_pixels(lambda pixel: close(pixel, WALL), wall, what="the wall")
        hmi.expect_pixels(lambda pixel: pixel != hmi.pixel(2.5, 0.5), known[1], what="a field")
        with_field = hmi.settled_picture()
        view = hmi.view()
        hmi.turn(f"{VIEW}&colour=value&layers=map")
        expect(hmi.row("hot")).to_be_visible()
        hmi.expect_pixels(lambda pixel: close(pixel, WALL), wall, what="the wall")
        bare = hmi.settled_picture()
        assert hmi.view() == view
        for point in (wall, free, corner):
            at = view.pixel(*point)
            assert with_field.getpixel(at) == bare.getpixel(at)
        for point, share in zip(known, shares, strict=True):
            at = view.pixel(*point)
            assert close(rgb(with_field, at), over(rgb(bare, at), "temperature", share))


def rgb(picture: Any, at: tuple[int, int]) -> Pixel:
    red, green, blue = picture.getpixel(at)
    return red, green, blue


def test_a_pin_is_on_its_pose_and_in_its_cell(domain: int, open_page: OpenPage) -> None:
    with bridge(domain=domain) as running:
        running.peer.publish_map(occupancy_grid([[0] * 6] * 6))
        at = (3.125, 2.375)
        running.peer.observe(scan("a", {"co2": 600.0}, at=at))
        running.tag("a")
        hmi = open_page(running.url, "sensor=co2")
        for camera in ("view=3,3,6", "view=3.1,2.4,0.4"):
            hmi.turn(f"sensor=co2&{camera}&layers=map")
            expect(hmi.row("a")).to_be_visible()
            bare = hmi.settled_picture()
            hmi.turn(f"sensor=co2&{camera}&layers=map,pins")
            pin = hmi.lasting_change(bare)
            x, y = hmi.view().pixel(*at)
            assert abs((pin.left + pin.right - 1) / 2 - x) <= 1
            assert abs((pin.top + pin.bottom - 1) / 2 - y) <= 1
            # Its body has the colour of its verdict, here above the sign.
            assert close(hmi.pixel(at[0], at[1] + 6 / hmi.view().scale), HEALTHY)
        # At this zoom a cell is as large as the pin, and the pin's is the known one whose
        # centre is nearest: the field's value there is the tag's own.
        hmi.page.keyboard.press("Escape")
        hmi.point_at(*at)
        expect(hmi.test_id("readout")).to_have_text("600 ppmidealx 3.12 m, y 2.38 m")
        hmi.page.mouse.move(1, 1)
        running.peer.observe(scan("a", {"co2": 9000.0}, at=at))
        # Above its sign, and in the corner that a square has and a disc has not.
        metre = hmi.view().scale
        above, corner = (at[0], at[1] + 7 / metre), (at[0] + 9 / metre, at[1] + 9 / metre)
        hmi.expect_pixels(lambda pixel: close(pixel, CRITICAL), above, corner, what="a red square")


# Records the width of each label's picture, and of its drawn text.
WATCH_LABELS = """
  const paint = CanvasRenderingContext2D.prototype.fillText;
  window.labels = [];
  CanvasRenderingContext2D.prototype.fillText = function (text, ...place) {
    const isLabel = this.font.includes('11.5px');
    if (isLabel) labels.push([text, this.canvas.width, this.measureText(text).width]);
    return paint.call(this, text, ...place);
  };
"""


def test_a_label_is_as_wide_as_its_text(greenhouse: Bridge, open_page: OpenPage) -> None:
    hmi = open_page(greenhouse.url, go=False)
    hmi.page.add_init_script(WATCH_LABELS)
    hmi.go()
    hmi.expect_samples(3)
    hmi.settled_picture()
    # Once more, with the font loaded meanwhile.
    hmi.page.evaluate("document.fonts.ready.then(() => { labels.length = 0; })")
    hmi.page.emulate_media(color_scheme="dark")
    hmi.expect(lambda: hmi.page.evaluate("labels.length") >= 5, "all labels painted anew")
    for text, picture, wide in hmi.page.evaluate("labels"):
        # 5 pixels of padding on each side, all in whole pixels.
        assert picture == math.ceil(wide) + 10, text


# Created before `open_page`, so that it ends after the pages.
@pytest.fixture
def running(domain: int) -> Iterator[Bridge]:
    with bridge(domain=domain) as empty:
        yield empty


def expect_status_beside_a_card(hmi: Hmi) -> None:
    """With a long greenhouse, the status is a line while a card is open."""
    expect(hmi.test_id("health-strip")).to_be_hidden()
    hmi.page.locator("tbody tr[data-tag-id]").first.click()
    expect(hmi.test_id("health-strip")).to_be_visible()
    hmi.page.keyboard.press("Escape")


def test_a_wide_greenhouse_is_as_wide_as_half_the_window_below_its_status(
    running: Bridge, open_page: OpenPage
) -> None:
    running.peer.observe(scan("1", {"temperature": 22.0}, at=(1, 1)))
    hmi = open_page(running.url, viewport={"width": 1440, "height": 900})
    parts = (".health", ".map-panel", ".list")
    status, map_, table = places(hmi, *parts)
    assert (status.left, status.bottom) == (table.left, table.top)
    narrow = map_.right
    running.peer.publish_map(occupancy_grid([[0] * 60] * 18))
    expect(hmi.page.locator(".panels")).to_have_attribute("data-wide", "true")
    for size in ((1440, 900), (1100, 800)):
        hmi.resize(*size)
        status, map_, table = places(hmi, *parts)
        assert (status.left, status.bottom) == (map_.left, map_.top), size
        assert (table.left, table.top) == (map_.right, status.top), size
        expect_in_reach(hmi, ".map-controls button, .legend, tbody tr, .health button")
        assert (
            hmi.page.locator(".table-scroll").evaluate("e => e.scrollWidth - e.clientWidth") == 0
        ), size
        assert size != (1440, 900) or map_.right > 1.2 * narrow
        # In the order of reading for the keyboard, too.
        expect(hmi.page.locator(".health, .map-panel").first).to_have_class("health")
    hmi.resize(820, 1180)
    hmi.page.locator(".pane-tabs").get_by_role("button", name="Map").click()
    map_, table = places(hmi, ".map-panel", ".list")
    assert (map_.left, map_.bottom) == (table.left, table.top - 1)
    expect_in_reach(hmi, ".map-controls button, .legend, tbody tr")
    # The tag's card takes the table's place; a phone shows one of the three.
    hmi.row("1").click()
    expect(hmi.card("1")).to_be_visible()
    expect(hmi.page.locator(".list")).to_be_hidden()
    hmi.turn("")
    hmi.resize(360, 640)
    hmi.page.locator(".pane-tabs").get_by_role("button", name="Tags").click()
    expect(hmi.map).to_be_hidden()
    status, table = places(hmi, ".health", ".list")
    assert (status.left, status.bottom) == (table.left, table.top)
    # On a wall screen, too.
    hmi.resize(1280, 720)
    hmi.go(query="?kiosk=1")
    expect(hmi.page.locator(".panels > .health")).to_be_visible()
    hmi.expect_map()
    status, map_ = places(hmi, ".health", ".map-panel")
    assert (status.left, status.bottom) == (map_.left, map_.top)
    assert map_.right > 0.6 * 1280


def test_a_long_greenhouse_is_as_wide_as_the_page_below_its_table(
    running: Bridge, open_page: OpenPage
) -> None:
    running.peer.observe(scan("1", {"temperature": 22.0}, at=(1, 1)))
    hmi = open_page(running.url, viewport={"width": 1440, "height": 900})
    narrow = places(hmi, ".map-panel")[0].right
    running.peer.publish_map(occupancy_grid([[0] * 60] * 8))
    expect(hmi.page.locator(".panels")).to_have_attribute("data-long", "true")
    status, map_, table = places(hmi, ".health", ".map-panel", ".list")
    assert (map_.left, map_.right, map_.bottom) == (0, 1440, 900)
    assert status.right == table.left
    assert status.bottom == table.bottom == map_.top > 400
    expect_status_beside_a_card(hmi)
    # A tall one leaves the table what it does not need.
    running.peer.publish_map(occupancy_grid([[0] * 20] * 40))
    hmi.expect(lambda: places(hmi, ".map-panel")[0].right < 0.8 * narrow, "a slim map")
