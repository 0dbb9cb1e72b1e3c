"""A greenhouse of thousands of tags: the page renders only the visible rows, without gaps."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import pytest
from playwright.sync_api import expect

from tests.bench.greenhouse_double import greenhouse_of
from tests.browser.hmi import PHONE, WIDE, Hmi, OpenPage
from tests.browser.places import place
from tests.browser.test_accessibility import violations
from tests.support.web import Bridge

TAGS = 2_000
# More than the rows of any window with the spare ones; far less than all.
MOST = 100

IS_ON_THE_SCREEN = """row => { const { x, y, height } = row.getBoundingClientRect();
  return document.elementFromPoint(x + 90, y + height / 2)?.closest('tr') === row; }"""

OpenGreenhouse = Callable[..., Hmi]

# A server that is silent for 3 s causes a message above the table, which has less room then.
GOES_ON = """
setInterval(() => { if (document.querySelector('tr[data-tag-id]')) greenhouse.idle(); }, 500);
"""


@pytest.fixture
def open_greenhouse(greenhouse: Bridge, open_page: OpenPage) -> OpenGreenhouse:
    """`open_greenhouse(tags, fragment, **options)`: the page of that many tags."""

    def open_one(tags: int = TAGS, fragment: str = "", **options: object) -> Hmi:
        hmi = open_page(greenhouse.url, go=False, **options)
        hmi.page.add_init_script(greenhouse_of(tags) + GOES_ON)
        hmi.go(fragment)
        expect(hmi.page.locator("tr[data-tag-id]").first).to_be_attached()
        return hmi

    return open_one


def test_the_page_renders_few_rows_and_shows_any(open_greenhouse: OpenGreenhouse) -> None:
    hmi = open_greenhouse()
    expect(hmi.page.get_by_role("table")).to_have_attribute("aria-rowcount", str(TAGS + 1))
    frame = hmi.page.locator(".table-scroll")
    # As wide as its place, with the gaps for the rows that are not rendered.
    table, last = hmi.page.get_by_role("table"), hmi.page.locator("thead th:visible").last
    hmi.expect(lambda: place(last).right == place(table).right, "a head as wide as the table")
    for share, tag_id in ((1.0, str(TAGS)), (0.5, str(TAGS // 2 + 5)), (0.0, "1")):
        frame.evaluate("(e, share) => { e.scrollTop = share * e.scrollHeight; }", share)
        expect(hmi.row(tag_id)).to_be_in_viewport()
        assert len(hmi.rows()) < MOST
        row = hmi.row(tag_id)
        assert row.get_attribute("aria-rowindex") == str(int(tag_id) + 1)
        # The element on the screen there is this row, not a gap. Waited for: late content above
        # the table pushes the last row below the window's edge, until the page has received more.
        hmi.expect(partial(row.evaluate, IS_ON_THE_SCREEN), f"row {tag_id} on the screen")


def test_the_chosen_row_comes_into_view_and_the_focus_is_never_lost(
    open_greenhouse: OpenGreenhouse,
) -> None:
    hmi = open_greenhouse(fragment=f"tag={TAGS - 3}")
    expect(hmi.row(str(TAGS - 3))).to_be_in_viewport()
    hmi.page.keyboard.press("n")
    expect(hmi.row(str(TAGS - 2))).to_be_in_viewport()
    expect(hmi.test_id("announced-choice")).to_contain_text(f"{TAGS - 2:d} of {TAGS:d}")
    # With the Tab key from row to row, further than the page's first rows.
    hmi.page.keyboard.press("Escape")
    hmi.page.locator(".table-scroll").evaluate("e => { e.scrollTop = 0; }")
    hmi.row("1").get_by_role("button").focus()
    focused = hmi.page.locator("tr[data-tag-id]:focus-within")
    further = len(hmi.rows()) + 5
    for index in range(further):
        hmi.page.keyboard.press("Tab")
        # No finger is fast enough to outrun the rendering of rows.
        expect(focused).to_have_attribute("data-tag-id", str(index + 2))
    expect(focused).to_be_in_viewport()
    # Scrolled far away it keeps its focus, and goes on from there.
    hmi.page.locator(".table-scroll").evaluate("e => { e.scrollTop = e.scrollHeight; }")
    expect(hmi.row(str(TAGS))).to_be_in_viewport()
    expect(focused).to_have_attribute("data-tag-id", str(further + 1))
    hmi.page.keyboard.press("Shift+Tab")
    expect(focused).to_be_in_viewport()


def test_axe_and_windows_of_any_size(open_greenhouse: OpenGreenhouse) -> None:
    hmi = open_greenhouse(1_000, "tag=3", bypass_csp=True)
    for viewport in (WIDE, PHONE):
        hmi.resize(**viewport)
        tabs = hmi.page.locator(".pane-tabs")
        if tabs.is_visible():
            tabs.get_by_role("button", name="Tags").click()
        expect(hmi.row("3")).to_be_in_viewport()
        assert len(hmi.rows()) < MOST
        assert violations(hmi) == []
    hmi.page.emulate_media(forced_colors="active")
    assert hmi.row("3").evaluate("row => getComputedStyle(row).outlineWidth") == "3px"
    # A new filter leads to its first match, also on a phone, where the panel scrolls.
    hmi.page.locator(".tags-panel").evaluate("e => { e.scrollTop = e.scrollHeight; }")
    hmi.expect(lambda: hmi.page.locator(".tags-panel").evaluate("e => e.scrollTop > 0"), "scrolled")
    hmi.page.evaluate("location.hash = 'filter=lupin'")
    expect(hmi.row("1")).to_be_in_viewport()


@pytest.mark.parametrize("tags", [30, 300])
def test_all_rows_have_the_same_height(open_greenhouse: OpenGreenhouse, tags: int) -> None:
    """Otherwise the table would jump as it scrolls, or when a tag is found."""
    hmi = open_greenhouse(tags)
    hmi.page.evaluate("greenhouse.unpin(3)")
    expect(hmi.row("3")).to_have_attribute("data-pinned", "false")
    heights = hmi.page.locator("tr[data-tag-id]").evaluate_all(
        "rows => rows.map(row => row.getBoundingClientRect().height)"
    )
    assert len(set(heights)) == 1
