"""A wall screen, for viewing only: an accidental touch changes nothing."""

import re
from typing import Final

from playwright.sync_api import expect

from tests.browser.hmi import PHONE, Hmi, OpenPage
from tests.browser.places import places
from tests.support.web import Bridge

# At one moment: the list's content depends on its room.
_NONE_IS_CUT = """() => {
  const bottom = (element) => element.getBoundingClientRect().bottom;
  const rows = [...document.querySelectorAll('li[data-fits=true]')];
  return rows.every((row) => bottom(row) <= bottom(document.querySelector('.attention')));
}"""

# Of the rows that are shown, and of those that have no room.
_TAGS = """() => ['true', 'false'].map(fits =>
  [...document.querySelectorAll(`li[data-fits=${fits}]`)].map(row => row.dataset.tagId))"""


def test_a_wall_screen_that_is_touched_stays_as_its_link_says(
    greenhouse: Bridge, open_page: OpenPage
) -> None:
    wall = open_page(greenhouse.url, "sensor=humidity&tag=1", "?kiosk=1", has_touch=True)
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
    # Without the mouse on it, all of that is gone.
    wall.page.mouse.move(1, 1)
    wall.page.evaluate("document.activeElement.blur()")
    expect(wall.test_id("hover-card")).to_have_count(0)
    wall.expect_picture(picture)
    assert wall.view() == view
    assert wall.address() == address
    expect(wall.test_id("tag-card")).to_have_count(0)
    expect(wall.test_id("legend")).to_contain_text("Humidity %")
    # Nothing to drag, nothing to click on.
    wall.point_at(1, 3)
    assert wall.map.evaluate("map => getComputedStyle(map).cursor") == "default"
    # To assistive technology it is a picture, not a control.
    expect(wall.map).to_have_attribute("role", "img")


def test_a_wall_screen_rotates_and_the_named_key_leaves_it(
    greenhouse: Bridge, open_page: OpenPage
) -> None:
    wall = open_page(greenhouse.url, "sensor=temperature", "?kiosk=1&cycle=5")
    note, legend = wall.test_id("kiosk-note"), wall.test_id("legend")
    # Too low for the whole list: it shows how many tags are left, and cuts none in two.
    wall.resize(1100, 440)
    row, since = places(wall, ".attention > ul > li", ".attention-do small:not(:empty)")
    assert since.right == row.right

    def shows_how_many_are_left() -> bool:
        listed, left = wall.page.evaluate(_TAGS)
        count = len({*left} - {*listed}) or len({*left})
        more = wall.page.locator(".attention-more")
        return more.all_inner_texts() == [f"+ {count} more"]

    wall.expect(shows_how_many_are_left, "how many are left")
    wall.expect(lambda: wall.page.evaluate(_NONE_IS_CUT) is True, "each of the list whole")
    expect(legend).to_contain_text("Humidity %")
    wall.page.keyboard.press("Escape")
    expect(wall.test_id("tag-table")).to_be_visible()
    # What the link names, not the last view.
    expect(wall.page).not_to_have_url(re.compile("kiosk"))
    expect(legend).to_contain_text("Temperature °C")
    wall.page.go_back()
    expect(note).to_be_visible()


_HEADER = (".brand", ".origin", ".connection", ".kiosk-note")


def _middle(wall: Hmi, part: str) -> float:
    (box,) = places(wall, part)
    return (box.top + box.bottom) / 2


def test_on_a_phone_open_actions_come_first_in_full_and_the_page_scrolls(
    greenhouse: Bridge, open_page: OpenPage
) -> None:
    wall = open_page(
        greenhouse.url,
        "sensor=humidity",
        "?kiosk=1",
        viewport=PHONE,
        has_touch=True,
        is_mobile=True,
    )
    wall.expect_samples(3)
    needs = wall.page.locator("li[data-fits]")
    wall.expect(lambda: needs.count() > 0, "what is to be done")
    expect(wall.page.locator("li[data-fits=false]")).to_have_count(0)

    def are_in_order() -> bool:
        line, first, last, plan = places(
            wall, ".patrol-line", ".attention h3", ".attention > ul > li:last-child", ".map-view"
        )
        return line.bottom <= first.top and last.bottom <= plan.top

    wall.expect(are_in_order, "the list above the map, nothing over it")
    # What a row waits for takes no line of its own.
    row = "li[data-tag-id='3'] .attention-do"
    expect(wall.page.locator(f"{row} small")).to_have_text("no alarm yet")
    todo, waits = places(wall, f"{row} strong", f"{row} small")
    assert waits.top < todo.bottom
    # Its header is one row on a phone of the usual width.
    wall.resize(390, 740)
    wall.expect(lambda: len({round(_middle(wall, part)) for part in _HEADER}) == 1, "one row")
    wall.resize(**PHONE)
    # The chosen sensor is scrolled into its row, and the page does not move.
    assert wall.page.evaluate("scrollY") == 0
    wall.map.scroll_into_view_if_needed()
    assert wall.page.evaluate("scrollY") > 0
    wall.page.evaluate("scrollTo(0, 0)")
    leave = wall.page.get_by_role("button", name="Exit")
    expect(leave.locator("kbd")).to_be_hidden()
    leave.tap()
    expect(wall.map).to_have_attribute("role", "application")


BREAK: Final = """() => {
  window.stayed = true;
  CanvasRenderingContext2D.prototype.clearRect = () => { throw new Error('no more canvas'); };
}"""


def test_a_wall_screen_that_fails_recovers_by_itself(
    greenhouse: Bridge, open_page: OpenPage
) -> None:
    wall = open_page(greenhouse.url, "sensor=humidity", "?kiosk=1")
    wall.expect_samples(3)
    wall.allow_noise("no more canvas")
    wall.page.evaluate(BREAK)
    wall.page.set_viewport_size({"width": 1000, "height": 700})
    expect(wall.test_id("failed-page")).to_contain_text("reloads automatically")
    wall.expect_samples(3)
    assert wall.page.evaluate("window.stayed") is None
