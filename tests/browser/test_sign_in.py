"""Signing in as a person does: the page, a wrong token, the right one, and coming back."""

import re
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Browser, BrowserContext, Page, expect

from tests.browser.hmi import FONTS, slow_down
from tests.support.access import TOKEN, Served, served
from tests.support.messages import inspection
from tests.support.people import PASSWORD, add
from tests.support.waiting import PATIENCE_S
from tests.support.web import bridge


@pytest.fixture(scope="module")
def closed() -> Iterator[Served]:
    with served(LUPIN_TOKEN=TOKEN) as running:
        yield running
        assert TOKEN not in running.process.output


@pytest.fixture
def context(browser: Browser) -> Iterator[BrowserContext]:
    with browser.new_context(ignore_https_errors=True) as own:
        own.set_default_timeout(PATIENCE_S * 1000)
        yield own


@pytest.fixture
def page(context: BrowserContext) -> Page:
    return new_page(context)


def new_page(context: BrowserContext) -> Page:
    """A page that `SLOW_PAGES` slows down."""
    page = context.new_page()
    slow_down(page)
    return page


def sign_in(page: Page, token: str) -> None:
    page.get_by_label("Access code (token)").fill(token)
    page.get_by_role("button", name="Sign in").click()


def expect_live(page: Page) -> None:
    """Wait for the HMI, connected over its WebSocket."""
    expect(page.get_by_test_id("app")).to_have_attribute("data-connection-state", "live")


def test_a_person_signs_in_with_the_keyboard_alone(closed: Served, page: Page) -> None:
    addresses: list[str] = []
    page.on("request", lambda request: addresses.append(request.url))
    page.goto(closed.url)
    expect(page).to_have_url(closed.url + "/signin")
    expect(page.get_by_label("Access code (token)")).to_be_focused()
    # The page's mark and font need no token.
    expect(page.locator("h1 img")).not_to_have_js_property("naturalWidth", 0)
    assert page.evaluate(FONTS) == ["loaded"]
    page.keyboard.type(TOKEN)
    page.keyboard.press("Enter")
    expect(page).to_have_url(re.compile(f"^{closed.url}/(#.*)?$"))
    expect_live(page)
    assert not [address for address in addresses if TOKEN in address]


def test_with_a_name_the_page_says_who_sees_what_is_done_to_alarms(
    domain: int, browser: Browser, tmp_path: Path
) -> None:
    accounts = tmp_path / "accounts.sqlite"
    add(accounts, anna="operator", vera="viewer")
    with bridge("--accounts", str(accounts), domain=domain) as running:
        running.peer.wait_for_twin()
        running.peer.observe(inspection("a", anomaly=True))
        for name, words in (("anna", "Signed in as anna"), ("vera", "vera (viewer)")):
            with browser.new_context() as context:
                context.set_default_timeout(PATIENCE_S * 1000)
                page = new_page(context)
                page.goto(running.url)
                page.get_by_label("Name").fill(name)
                page.get_by_label("Password or access code").fill(PASSWORD)
                page.keyboard.press("Enter")
                expect_live(page)
                page.keyboard.press("a")
                expect(page.locator(".sharing-note")).to_contain_text(words)


def test_a_wrong_token_can_be_corrected_and_nothing_of_the_right_one_is_stored(
    closed: Served, page: Page
) -> None:
    page.goto(closed.url + "/signin")
    sign_in(page, TOKEN[::-1].strip("=") + "x")
    expect(page.get_by_role("alert")).to_have_text("The access code is wrong.")
    sign_in(page, "not a token")
    expect(page.get_by_role("alert")).to_have_text(re.compile("letters, digits"))
    assert "/signin" in page.url
    sign_in(page, f" {TOKEN} ")
    expect_live(page)

    stored = page.evaluate(
        "() => JSON.stringify([{...localStorage}, {...sessionStorage}, document.cookie])"
    )
    assert TOKEN not in stored
    assert "lupin_session" not in stored, "scripts do not see the cookie"
    (cookie,) = page.context.cookies()
    assert cookie["httpOnly"]
    assert cookie["sameSite"] == "Strict"
    assert not cookie["secure"]
    assert TOKEN not in cookie["value"]


def test_a_link_on_another_page_leads_in_although_the_cookie_is_strict(
    closed: Served, page: Page
) -> None:
    page.goto(closed.url + "/signin")
    sign_in(page, TOKEN)
    expect_live(page)
    page.goto("data:text/html,elsewhere")
    page.evaluate("url => { location.href = url }", closed.url + "/")
    expect_live(page)
    # And out again.
    page.get_by_role("button", name="Menu").click()
    page.get_by_role("button", name="Sign out").click()
    expect(page).to_have_url(closed.url + "/signin")
    page.goto(closed.url)
    expect(page).to_have_url(closed.url + "/signin")
    expect(page.get_by_test_id("app")).to_have_count(0)


def test_a_page_whose_session_has_ended_goes_to_the_sign_in_page(page: Page) -> None:
    """Its next connection is refused, with a status that a WebSocket does not show to a page."""
    with served(LUPIN_TOKEN=TOKEN) as first:
        page.goto(first.url + "/signin")
        sign_in(page, TOKEN)
        expect_live(page)
        page.goto(first.url + "/#tag=7&sensor=co2")
        page.context.clear_cookies()
        port = str(urlsplit(first.url).port)
    with served("--port", port, LUPIN_TOKEN=TOKEN) as second:
        assert second.url == first.url
        expect(page).to_have_url(re.compile("/signin#ended&"))
        expect(page.get_by_role("alert")).to_have_text(re.compile("^Your session has ended"))
        # And back to what was shown.
        sign_in(page, TOKEN)
        expect(page).to_have_url(re.compile(f"^{second.url}/#.*sensor=co2&tag=7"))
