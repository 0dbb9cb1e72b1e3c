"""Hostile strings are shown as text, and the page keeps its layout."""

import re
from collections.abc import Iterator
from functools import partial
from urllib.parse import parse_qs, urlsplit

import pytest
from playwright.sync_api import expect

from tests.browser.hmi import PHONE, Hmi, OpenPage
from tests.support.domains import own_domain
from tests.support.messages import inspection, occupancy_grid, scan
from tests.support.web import Bridge, bridge

SCRIPT = "<script>alert('tag')</script>"
IMAGE = "<img src=x onerror=alert('species')>"
HOSTILE_IDS = (
    SCRIPT,
    IMAGE,
    "\u202egnp.exe\u202c",  # reverses the text after it
    "\x01\x1b[31m\x7f\x9bred",
    "zero\u200bwidth\u2066joined",
    "__proto__",
    "constructor",
    "a'b\"c`d\\e]",
    "../../api/state?x=1#y&z",
    "%00%2e%2e%2f",
    "Z" + "\u0300\u0301\u0302\u0303" * 20 + "algo",
    "\U0001f33b" * 40,
    "w" * 256,
    "   ",
)
HOSTILE_SENSORS = ("__proto__", "toString", "<b>bold</b>", "n" * 256, "\u202espeed")


@pytest.fixture(scope="module")
def hostile() -> Iterator[Bridge]:
    with own_domain() as domain, bridge(domain=domain) as running:
        running.peer.publish_map(occupancy_grid([[0] * 8] * 8))
        readings = {name: 1e12 * (-1) ** index for index, name in enumerate(HOSTILE_SENSORS)}
        for index, tag_id in enumerate(HOSTILE_IDS):
            at = (1 + index % 4, 1 + index // 4)
            running.peer.observe(
                scan(tag_id, {"temperature": 10.0 + index, **readings}, at=at),
                inspection(
                    tag_id, IMAGE * (1 + 2000 * (index == 0)), blooms=[at], anomaly=index % 2 == 0
                ),
            )
        running.tag(HOSTILE_IDS[-1], lambda tag: tag["species"])
        yield running


def nothing_sticks_out(hmi: Hmi) -> bool:
    return bool(
        hmi.page.evaluate(
            "document.documentElement.scrollWidth <= document.documentElement.clientWidth"
        )
    )


def test_every_string_is_shown_as_text_and_none_is_run(
    hostile: Bridge, open_page: OpenPage
) -> None:
    hmi = open_page(hostile.url)
    hmi.expect(lambda: set(hmi.rows()) == set(HOSTILE_IDS), "every tag")
    table = hmi.test_id("tag-table")
    expect(table).to_contain_text("<script>alert('tag')")
    expect(table).to_contain_text("<img src=x onerror=")
    assert hmi.page.locator("main script, main img").count() == 0
    text = hmi.page.evaluate("document.body.innerText")
    assert not re.search("[\u202a-\u202e\u2066-\u2069\u200b\x00-\x08\x0e-\x1f\x7f-\x9f]", text)
    assert "w" * 100 not in text
    assert "<img src=x onerror=" * 100 not in text
    assert nothing_sticks_out(hmi)
    box = hmi.app.bounding_box()
    assert box is not None
    assert box["height"] == 900


def test_every_such_tag_opens_its_card_and_every_such_sensor_can_be_chosen(
    hostile: Bridge, open_page: OpenPage
) -> None:
    hmi = open_page(hostile.url)
    hmi.expect(lambda: len(hmi.rows()) == len(HOSTILE_IDS), "every tag")
    rows, card = hmi.page.locator("tbody tr[data-tag-id]"), hmi.test_id("tag-card")
    for index, tag_id in enumerate(HOSTILE_IDS):
        rows.nth(hmi.rows().index(tag_id)).get_by_role("button").click()
        expect(card.locator("[data-sensor=temperature]")).to_contain_text(f"{10 + index}.0")
        assert card.get_attribute("data-tag-id") == tag_id
    # Its link names it, whatever its name is.
    for tag_id in (SCRIPT, "../../api/state?x=1#y&z"):
        rows.nth(hmi.rows().index(tag_id)).get_by_role("button").click()
        hmi.expect(partial(is_linked, hmi, tag_id), "its link")
        hmi.page.reload()
        expect(card).to_have_attribute("data-tag-id", tag_id)
    sensors = hmi.page.locator(".sensors input")
    declared = 1  # temperature: a declared sensor without readings has no button
    expect(sensors).to_have_count(declared + len(HOSTILE_SENSORS))
    for index, name in enumerate(sorted(HOSTILE_SENSORS)):
        sensors.nth(declared + index).check(force=True)
        expect(sensors.nth(declared + index)).to_have_value(name)
        hmi.expect_samples(len(HOSTILE_IDS))
    assert nothing_sticks_out(hmi)


def is_linked(hmi: Hmi, tag_id: str) -> bool:
    return parse_qs(urlsplit(hmi.address()).fragment).get("tag") == [tag_id]


def test_a_phone_and_a_wall_screen_show_it_too(hostile: Bridge, open_page: OpenPage) -> None:
    phone = open_page(hostile.url, viewport=PHONE)
    phone.expect(lambda: len(phone.rows()) == len(HOSTILE_IDS), "every tag")
    assert nothing_sticks_out(phone)
    phone.page.get_by_role("navigation").get_by_role("button", name="Tags").click()
    assert nothing_sticks_out(phone)
    wall = open_page(hostile.url, query="?kiosk=1")
    expect(wall.page.locator(".attention")).to_contain_text("<script>")
    assert nothing_sticks_out(wall)


def test_the_policy_of_the_page_runs_no_foreign_script(
    hostile: Bridge, open_page: OpenPage
) -> None:
    hmi = open_page(hostile.url)
    hmi.expect_phase("live")
    blocked = hmi.page.evaluate(
        """async () => {
          const blocked = [];
          addEventListener('securitypolicyviolation', (e) => blocked.push(e.effectiveDirective));
          const script = document.createElement('script');
          script.textContent = 'window.ran = true';
          document.body.append(script);
          const style = document.createElement('style');
          style.textContent = 'body { display: none }';
          document.body.append(style);
          document.body.insertAdjacentHTML('beforeend', '<b onclick="window.ran = true">x</b>');
          document.body.lastElementChild.click();
          const frame = document.createElement('iframe');
          frame.src = 'https://elsewhere.example/';
          document.body.append(frame);
          await fetch('https://elsewhere.example/').catch(() => {});
          const image = new Image();
          image.src = 'https://elsewhere.example/x.png';
          while (blocked.length < 6) await new Promise((resolve) => setTimeout(resolve, 10));
          return [window.ran === true, blocked];
        }"""
    )
    hmi.allow_noise("Content Security Policy|elsewhere")
    hmi.requests = [url for url in hmi.requests if "elsewhere.example" not in url]
    assert blocked[0] is False
    assert sorted(blocked[1]) == [
        "connect-src",
        "frame-src",
        "img-src",
        "script-src-attr",
        "script-src-elem",
        "style-src-elem",
    ]
