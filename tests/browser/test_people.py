"""Two people at two browsers: what the one says of an alarm, the other sees."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from playwright.sync_api import Browser, Locator, Page, expect

from tests.browser.hmi import slow_down
from tests.support.messages import look
from tests.support.people import PASSWORD, add
from tests.support.waiting import PATIENCE_S
from tests.support.web import bridge


@contextmanager
def alarms_of(browser: Browser, url: str, name: str) -> Iterator[Page]:
    """The list of alarms of somebody who has signed in."""
    with browser.new_context() as context:
        context.set_default_timeout(PATIENCE_S * 1000)
        page = context.new_page()
        slow_down(page)
        page.goto(url)
        page.get_by_label("Name").fill(name)
        page.get_by_label("Password or token").fill(PASSWORD)
        page.keyboard.press("Enter")
        expect(page).to_have_url(re.compile(f"^{url}/(#.*)?$"))
        expect(page.get_by_test_id("app")).to_have_attribute("data-connection-state", "live")
        page.keyboard.press("a")
        yield page


def row(page: Page) -> Locator:
    return page.locator("[data-alarm]")


def act(page: Page, what: str) -> None:
    """Choose what to do from the menu of the row."""
    row(page).get_by_role("button", name=re.compile("^Actions: ")).click()
    row(page).get_by_role("button", name=what, exact=True).click()


def test_a_word_is_everybodys_and_a_viewer_has_none(
    domain: int, browser: Browser, tmp_path: Path
) -> None:
    path = tmp_path / "accounts.sqlite"
    add(path, anna="operator", vera="viewer")
    with bridge("--accounts", str(path), domain=domain) as running:
        running.peer.wait_for_twin()
        running.peer.observe(look("a", anomaly=True, bug_count=2))
        with (
            alarms_of(browser, running.url, "anna") as anna,
            alarms_of(browser, running.url, "vera") as vera,
        ):
            expect(anna.locator(".alarms-mine")).to_contain_text("Signed in as anna")
            expect(vera.locator(".alarms-mine")).to_contain_text("vera (viewer)")
            expect(row(vera)).to_have_attribute("data-acknowledged", "false")
            expect(vera.get_by_role("button", name=re.compile("^Acknowledge"))).to_have_count(0)
            anna.get_by_role("button", name=re.compile("^Acknowledge: ")).click()
            for page in (anna, vera):
                expect(row(page)).to_have_attribute("data-acknowledged", "true")
                expect(row(page).locator(".alarm-status")).to_contain_text("acknowledged by anna")
            anna.reload()
            anna.keyboard.press("a")
            expect(row(anna)).to_have_attribute("data-acknowledged", "true")
            act(anna, "Shelve")
            anna.get_by_label("Reason").fill("sprayed")
            anna.get_by_role("button", name="For 1 h").click()
            for page in (anna, vera):
                expect(row(page)).to_contain_text(re.compile(r"shelved by anna until \d"))
                expect(row(page)).to_contain_text("sprayed")
