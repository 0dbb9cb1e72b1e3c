"""The mouse on a pin: a card in short, which is never in the way."""

from playwright.sync_api import Locator, expect

from tests.browser.hmi import Hmi

# Where the pins of `house.py` are.
PINS = {"10": (1, 3), "1": (1, 1), "2": (3, 1), "3": (3, 3), "seen": (4, 2)}


def hover_card(hmi: Hmi) -> Locator:
    return hmi.test_id("hover-card")


def test_it_stands_inside_the_map_and_off_its_pin(hmi: Hmi) -> None:
    for fragment in ("view=1,2,2.2", "view=3,2,2.2"):
        hmi.turn(fragment)
        expect_every_card_off_its_pin(hmi)


def expect_every_card_off_its_pin(hmi: Hmi) -> None:
    """The card of each pin in sight, inside the map."""
    frame = hmi.map.bounding_box()
    assert frame is not None
    view, seen = hmi.view(), 0
    for tag_id, at in PINS.items():
        x, y = view.pixel(*at)
        under = "([x, y]) => !!document.elementFromPoint(x, y)?.closest('#map-view')"
        if not hmi.page.evaluate(under, [frame["x"] + x, frame["y"] + y]):
            continue  # out of sight, or under a button
        hmi.point_at(*at)
        expect(hover_card(hmi)).to_have_attribute("data-tag-id", tag_id)
        assert hover_card(hmi).evaluate("card => getComputedStyle(card).pointerEvents") == "none"
        box = hover_card(hmi).bounding_box()
        assert box is not None
        left, top = box["x"] - frame["x"], box["y"] - frame["y"]
        assert left >= 0
        assert top >= 0
        assert left + box["width"] <= frame["width"]
        assert top + box["height"] <= frame["height"]
        covers = left <= x <= left + box["width"] and top <= y <= top + box["height"]
        assert not covers
        seen += 1
    assert seen >= 2
