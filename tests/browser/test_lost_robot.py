"""A tag that a lost robot pinned far away: the page opens on the others, and lists it."""

import json
import re
from collections.abc import Iterator
from typing import Any, Final

import pytest
from playwright.sync_api import WebSocketRoute, expect

from tests.browser.hmi import Hmi, OpenPage, View
from tests.support.domains import own_domain
from tests.support.messages import inspection, scan
from tests.support.web import Bridge, bridge

AT_HOME: Final = {"1": (0.0, 0.0), "2": (4.0, 0.0), "3": (0.0, 3.0), "4": (4.0, 3.0)}
# How far around the tags the heat map goes, m.
REACH: Final = 1.5
PLANTER: Final = [(4990.0, 0.0), (5000.0, 0.0), (5000.0, 2.0), (4990.0, 2.0)]


@pytest.fixture(scope="module")
def site() -> Iterator[Bridge]:
    """Four tags at home, one at x = 5,000 m, and a planter that was seen there."""
    any_pose = ("--ros-args", "-p", "max_pose_m:=1000000.0")
    with own_domain() as domain, bridge(*any_pose, domain=domain) as running:
        for tag_id, at in AT_HOME.items():
            running.peer.observe(scan(tag_id, {"temperature": 20.0 + at[0]}, at=at))
        running.peer.observe(
            scan("lost", {"temperature": 30.0}, at=(5000.0, 1.0)),
            inspection("1", "lupin", blooms=[(4995.0, 1.0)], footprint=PLANTER),
        )
        running.tag("1", lambda tag: tag["species"])
        yield running


def is_home_in(hmi: Hmi, view: View) -> bool:
    """Whether everything at home is visible."""
    box = hmi.map.bounding_box()
    assert box is not None
    left, bottom = view.pixel(-REACH, -REACH)
    right, top = view.pixel(4 + REACH, 3 + REACH)
    return left >= 0 and top >= 0 and right <= box["width"] and bottom <= box["height"]


def test_the_page_opens_on_the_tags_at_home_and_lists_the_one_far_off(
    site: Bridge, open_page: OpenPage
) -> None:
    hmi = open_page(site.url)
    hmi.expect(lambda: set(hmi.rows()) == {*AT_HOME, "lost"}, "every tag")
    chip = hmi.row("lost").locator(".chip")
    expect(chip).to_have_text("Too far away, not on the map")
    expect(chip).to_have_attribute("title", re.compile("x 5000.00 m"))
    expect(hmi.page.locator("tbody .chip")).to_have_count(1)
    hmi.expect_samples()
    hmi.expect_phase("live")
    hmi.expect(lambda: is_home_in(hmi, hmi.view()), "the tags at home")
    assert hmi.view().scale > 50, "no wider than the tags at home"
    # A card of such a tag has everything but a position on the map.
    hmi.row("lost").get_by_role("button").click()
    expect(hmi.card("lost")).to_contain_text("far from all other tags")
    assert hmi.view().scale > 50


def test_nothing_covers_the_label_of_a_stopped_robot(site: Bridge, open_page: OpenPage) -> None:
    hmi = open_page(site.url, go=False, viewport={"width": 1100, "height": 800})
    no_value = {"sensor": "", "value": None, "limit": None, "since": None}
    stopped = {"kind": "stopped", "verdict": "unknown", **no_value}
    # Another open action: a line of its own, which has no room.
    pest = {"kind": "pest", "verdict": "stressed", **no_value}

    def meet(socket: WebSocketRoute) -> None:
        def on_message(message: str | bytes) -> None:
            frame: dict[str, Any] = json.loads(message)
            if "health" in frame:
                frame["health"]["house"]["reasons"] = [stopped]
                frame["health"]["tags"]["4"] = {"verdict": "stressed", "reasons": [pest]}
            socket.send(json.dumps(frame))

        socket.connect_to_server().on_message(on_message)

    hmi.page.route_web_socket(re.compile("/ws/state"), meet)
    hmi.go(query="?lang=nl")
    todo = hmi.page.get_by_test_id("greenhouse-health")
    expect(todo.locator(".do-more")).to_be_visible()
    order = todo.locator(".do-now p strong")
    expect(order).to_have_text("Bij de robot gaan kijken")
    # The space before it may stand by itself at the end of a line.
    is_hit = """at => [...at.getClientRects()].filter(it => it.width > 9).every(
      it => at.contains(document.elementFromPoint(it.right - 5, it.y + it.height / 2)))"""
    assert order.evaluate(is_hit)
