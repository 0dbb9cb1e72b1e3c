"""Two people at two browsers: what the one says of an alarm, the other sees."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from playwright.sync_api import Browser, Locator, Page, expect

from tests.browser.hmi import slow_down
from tests.support.messages import look, scan
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


def comment(page: Page, where: Locator | None, text: str) -> None:
    """Of an alarm from the menu of its row (None), else by the button there."""
    if where is None:
        act(page, "Comment")
    else:
        where.get_by_role("button", name=re.compile("^Comment: ")).click()
    page.locator(".comment-field textarea").fill(text)
    page.get_by_role("button", name="Save").click()
    expect(page.locator(".comment-field")).to_have_count(0)


def test_a_comment_is_seen_by_everybody_where_and_when_it_is_about(
    domain: int, browser: Browser, tmp_path: Path
) -> None:
    path = tmp_path / "accounts.sqlite"
    add(path, anna="operator", vera="viewer")
    with bridge("--accounts", str(path), domain=domain) as running:
        running.peer.wait_for_twin()
        running.peer.observe(look("a", anomaly=True, bug_count=2))
        running.peer.observe(scan("a", {"temperature": 21.0}))
        with (
            alarms_of(browser, running.url, "anna") as anna,
            alarms_of(browser, running.url, "vera") as vera,
        ):
            comment(anna, None, "aphids on <b>leaves</b>")
            for page in (vera, anna):
                said = row(page).get_by_test_id("comments")
                expect(said).to_contain_text("aphids on <b>leaves</b>")
                expect(said).to_contain_text("anna")
                row(page).locator(".alarm-go").click()
            # Where it is at once, it stays while the chart and all that was read comes.
            card = anna.get_by_test_id("tag-card")
            stood = card.locator(".say").bounding_box()
            expect(card.locator(".plot-view")).to_be_visible()
            assert card.locator(".say").bounding_box() == stood
            comment(anna, card, "sampled")
            comment(anna, anna.get_by_test_id("timebar"), "vents stuck")
            expect(vera.get_by_test_id("tag-card").get_by_test_id("comments")).to_contain_text(
                "sampled"
            )
            expect(
                vera.get_by_role("button", name=re.compile("^(Comment|Withdraw)"))
            ).to_have_count(0)
            for place in ("timebar", "tag-card"):
                mark = vera.get_by_test_id(place).locator(".comment-marks button")
                expect(mark).to_have_count(1)
                expect(mark.locator(".comment-text")).to_be_hidden()
                mark.focus()
                vera.keyboard.press("Shift+Tab")
                vera.keyboard.press("Tab")
                expect(mark.locator(".comment-text")).to_be_visible()
                expect(mark).to_contain_text("greenhouse: vents stuck")
                expect(mark).to_contain_text("Tag a: sampled")
            row(anna).get_by_role("button", name=re.compile("^Withdraw: ")).click()
            expect(row(vera).get_by_test_id("comments")).to_have_count(0)
