"""The guide of `make docs`, served by a bridge, without errors in the browser."""

import re

import pytest
from playwright.sync_api import Page, expect

from lupin_bridge.app import GUIDE_FOLDER
from lupin_bridge.settings import option, table
from tests.browser.hmi import OpenPage
from tests.support.docs import DOCS
from tests.support.web import bridge

# 2 MB and the pictures of the pages.
MAX_BYTES = 6_000_000
SOURCES = sorted(file.relative_to(DOCS).with_suffix("") for file in DOCS.rglob("*.md"))


@pytest.fixture(scope="module")
def url() -> object:
    with bridge() as running:
        yield running.url


@pytest.fixture
def page(url: str, open_page: OpenPage) -> Page:
    """A page; any error in the browser's console fails the test."""
    return open_page(url, go=False).page


def test_every_page_was_built_and_all_together_are_small() -> None:
    assert len(SOURCES) > 10
    assert [str(it) for it in SOURCES if not (GUIDE_FOLDER / f"{it}.html").is_file()] == []
    files = [file for file in GUIDE_FOLDER.rglob("*") if file.is_file()]
    assert sum(file.stat().st_size for file in files) < MAX_BYTES
    assert [file.name for file in files if file.suffix == ".map"] == []


def test_nothing_is_loaded_from_elsewhere() -> None:
    loaded = re.compile(r"""(?:src|href)=["'](https?:)?//(?!www\.sphinx|pradyunsg|github)""")
    for file in GUIDE_FOLDER.rglob("*.html"):
        for tag in re.findall(r"<(?:script|link|img)[^>]*>", file.read_text(encoding="utf-8")):
            assert not loaded.search(tag), (file, tag)


def test_the_first_page_leads_to_the_reference(page: Page, url: str) -> None:
    page.goto(f"{url}/docs/guide")
    expect(page).to_have_url(f"{url}/docs/guide/")
    expect(page).to_have_title("lupin-twin")
    page.get_by_role("link", name="Settings of the bridge").first.click()
    expect(page.get_by_role("heading", level=1)).to_contain_text("Settings of the bridge")
    expect(page.get_by_role("cell", name=option(table()[0].name)).first).to_be_visible()
    # Its styles apply: the sprite of icons takes no room, the theme can be chosen.
    expect(page.locator("svg").first).to_be_hidden()
    page.locator(".theme-toggle:visible").first.click()
    chosen = page.evaluate("localStorage.getItem('theme')")
    page.reload()
    assert page.evaluate("document.body.dataset.theme") == chosen


def test_it_can_be_searched(page: Page, url: str) -> None:
    page.goto(f"{url}/docs/guide/search.html?q=observations_topic")
    expect(page.locator("#search-results li a").first).to_be_visible()
