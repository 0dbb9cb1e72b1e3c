"""A wall screen, which is looked at: whoever brushes past it changes nothing."""

from __future__ import annotations

from playwright.sync_api import expect

from tests.browser.hmi import OpenPage
from tests.support.web import Bridge


def test_a_wall_screen_that_is_brushed_stays_as_its_link_says(
    house: Bridge, open_page: OpenPage
) -> None:
    wall = open_page(house.url, "sensor=humidity&tag=1", "?kiosk=1", has_touch=True)
    wall.expect_samples(3)
    picture, view, address = wall.settled_picture(), wall.view(), wall.address()
    x, y = view.pixel(1, 3)
    wall.map.tap(position={"x": x, "y": y})
    wall.click_map(3, 1)
    wall.map.dblclick(position={"x": 40, "y": 60})
    wall.page.mouse.wheel(0, -240)
    wall.page.mouse.down()
    wall.page.mouse.move(300, 300, steps=4)
    wall.page.mouse.up()
    for key in ("Enter", "+", "ArrowLeft", "n", "t", "3", "s", "Tab"):
        wall.page.keyboard.press(key)
    # Without the mouse on it there is nothing left of all that.
    wall.page.mouse.move(1, 1)
    wall.page.evaluate("document.activeElement.blur()")
    expect(wall.test_id("hover-card")).to_have_count(0)
    wall.expect_picture(picture)
    assert wall.view() == view
    assert wall.address() == address
    expect(wall.test_id("tag-card")).to_have_count(0)
    expect(wall.test_id("legend")).to_contain_text("Humidity %")
    # Nothing to grab, nothing to click on.
    wall.point_at(1, 3)
    assert wall.map.evaluate("map => getComputedStyle(map).cursor") == "default"
    # To assistive technology it is a picture, not something to operate.
    expect(wall.map).to_have_attribute("role", "img")
