"""axe-core reports nothing: light, dark, kiosk, phone, frozen, and with all panels open.

Only this file bypasses the page's own policy, to get axe into the page. High contrast is here too.
"""

import io
from typing import Any

import pytest
from PIL import Image
from playwright.sync_api import Locator, expect

from tests.browser.greenhouse import TAGS
from tests.browser.hmi import AXE, PHONE, SERVER_GONE, WIDE, Hmi, OpenPage, Pixel
from tests.support.messages import scan
from tests.support.web import Bridge, bridge

RULES = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"]


# The dark theme differs in colours alone.
OF_COLOURS = ["color-contrast", "link-in-text-block"]


def violations(hmi: Hmi) -> list[str]:
    """The violations that axe reports, in light and dark, each with its elements."""
    if not hmi.page.evaluate("'axe' in window"):
        hmi.page.evaluate(AXE.read_text(encoding="utf-8"))
    found = []
    for scheme in ("light", "dark"):
        hmi.page.emulate_media(color_scheme=scheme)
        expect(hmi.page.locator("html")).to_have_attribute("data-theme", scheme)
        objections: list[dict[str, Any]] = hmi.page.evaluate(
            "async (rules) => (await axe.run({ runOnly: rules })).violations",
            RULES if scheme == "light" else OF_COLOURS,
        )
        found += [
            f"{scheme}: {each['id']}: {each['help']}: {node['html'][:160]} "
            f"{node['failureSummary'][:300]}"
            for each in objections
            for node in each["nodes"]
        ]
    return found


@pytest.mark.parametrize(
    ("viewport", "query"), [(WIDE, "?kiosk=1"), (PHONE, "")], ids=["kiosk", "phone"]
)
def test_the_page_as_it_opens(
    greenhouse: Bridge, open_page: OpenPage, viewport: dict[str, int], query: str
) -> None:
    hmi = open_page(greenhouse.url, "tag=10", query, viewport=viewport, bypass_csp=True)
    hmi.expect_samples(3)
    assert violations(hmi) == []
    if viewport is PHONE:
        hmi.page.get_by_role("navigation").get_by_role("button", name="Tags").click()
        expect(hmi.row("1")).to_be_visible()
        assert violations(hmi) == []


def test_what_opens_on_demand(greenhouse: Bridge, open_page: OpenPage) -> None:
    hmi = open_page(greenhouse.url, "tag=10", bypass_csp=True)
    hmi.expect_rows(*TAGS)
    hmi.expect_samples(3)
    assert violations(hmi) == []
    hmi.page.get_by_role("button", name="Layers").click()
    assert violations(hmi) == []
    hmi.page.get_by_role("button", name="Menu").click()
    assert violations(hmi) == []
    hmi.page.keyboard.press("Escape")
    hmi.colour_by_value()
    assert violations(hmi) == []
    hmi.page.get_by_role("searchbox").fill("nothing like this")
    expect(hmi.page.locator(".no-match")).to_be_visible()
    assert violations(hmi) == []
    hmi.page.get_by_role("searchbox").blur()
    hmi.page.keyboard.press("?")
    expect(hmi.page.get_by_role("dialog")).to_be_visible()
    assert violations(hmi) == []


def test_table_alarms_and_charts(greenhouse: Bridge, open_page: OpenPage) -> None:
    """In the colouring that is not the default."""
    hmi = open_page(greenhouse.url, "colour=value&chart.tag=10&tag=10", bypass_csp=True)
    hmi.expect_rows(*TAGS)
    hmi.page.get_by_role("button", name="Show as table").first.click()
    expect(hmi.test_id("series-table").first).to_be_visible()
    assert violations(hmi) == []
    hmi.page.keyboard.press("a")
    expect(hmi.page.locator("[data-group=active] li").first).to_be_visible()
    assert violations(hmi) == []


def test_an_empty_greenhouse_and_a_frozen_one(domain: int, open_page: OpenPage) -> None:
    with bridge(domain=domain) as running:
        hmi = open_page(running.url, bypass_csp=True)
        expect(hmi.test_id("notice")).to_have_attribute("data-notice", "no-tags")
        hmi.page.keyboard.press("a")
        expect(hmi.page.locator("[data-note=none]")).to_be_visible()
        assert violations(hmi) == []
        running.peer.observe(*[scan("a", {"temperature": 99.0}, at=(1, 1))] * 2)
        hmi.page.get_by_role("button", name="Acknowledge: Tag a").click()
        hmi.page.get_by_role("button", name="Actions: Tag a").click()
        assert violations(hmi) == []
        hmi.page.get_by_role("button", name="Shelve").click()
        expect(hmi.page.get_by_label("Reason")).to_be_visible()
        assert violations(hmi) == []
        hmi.page.get_by_role("button", name="Notify me of alarms").click()
        assert violations(hmi) == []
        hmi.page.keyboard.press("Escape")
        hmi.allow_noise(SERVER_GONE)
        running.process.kill()
        hmi.expect_phase("reconnecting")
        assert violations(hmi) == []


def colours(thing: Locator) -> set[Pixel]:
    """All colours that it has on the screen, without the edge that it shares with its neighbour."""
    picture = Image.open(io.BytesIO(thing.screenshot())).convert("RGB")
    picture = picture.crop((1, 1, picture.width - 1, picture.height - 1))
    data = picture.tobytes()
    return set(zip(data[::3], data[1::3], data[2::3], strict=True))


def test_high_contrast_shows_what_is_chosen_and_what_a_colour_means(
    greenhouse: Bridge, open_page: OpenPage
) -> None:
    hmi = open_page(greenhouse.url, "tag=2", viewport=WIDE, forced_colors="active")
    hmi.expect_samples()
    hmi.settled_picture()
    expect(hmi.row("2")).to_have_attribute("data-selected", "true")
    hmi.page.locator(".health-counts [data-health=healthy]").first.click()
    hmi.page.evaluate(
        """() => {
          const probe = document.body.appendChild(document.createElement('i'));
          probe.id = 'probe';
          probe.style = 'position: fixed; inset: 0 auto auto 0; width: 3px; height: 3px;' +
            'background: Highlight; z-index: 99';
        }"""
    )
    (highlight,) = colours(hmi.page.locator("#probe"))
    hmi.open_details()
    for one, other in (
        (".sensors label:has(:checked)", ".sensors label:not(:has(:checked))"),
        (".colouring label:has(:checked)", ".colouring label:not(:has(:checked))"),
        (".health-counts [aria-pressed=true]", ".health-counts [aria-pressed=false]"),
        ("tr[data-selected=true] th", "tr[data-selected=false] th"),
        ("td.chosen", "td.other"),
    ):
        assert highlight in colours(hmi.page.locator(one).first), one
        assert highlight not in colours(hmi.page.locator(other).last), other
    assert highlight not in colours(hmi.page.locator(".sensors .swatch:visible"))
    assert len(colours(hmi.page.locator(".ideal-bar").first)) > 50
    # In the time bar, open actions stand out from failed scans.
    marks = [hmi.page.locator(f".timebar-picture [data-mark={it}]") for it in ("pest", "failures")]
    pest, failed = (mark.first.evaluate("e => getComputedStyle(e).fill") for mark in marks)
    assert pest != failed
