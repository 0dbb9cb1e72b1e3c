"""The page over all greenhouses, in a real browser, over a real archive."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from playwright.sync_api import Browser, expect
from playwright.sync_api import Page as BrowserPage

from tests.support.archive import Archive, forward_once, forwarder
from tests.support.fleet import Page, fleet, scans_lately, write
from tests.support.postgres import server


@contextmanager
def opened(browser: Browser, url: str, **context: object) -> Iterator[BrowserPage]:
    with browser.new_context(**context) as own:  # type: ignore[arg-type]
        page = own.new_page()
        problems: list[str] = []
        page.on("pageerror", lambda error: problems.append(str(error)))
        page.goto(url)
        yield page
        assert not problems


def picture(page: BrowserPage, name: str) -> None:
    """Kept where LUPIN_PICTURES says, for people to look at."""
    folder = os.environ.get("LUPIN_PICTURES")
    if folder:
        page.screenshot(path=str(Path(folder) / f"fleet-{name}.png"))


@contextmanager
def three_sites(archive: Archive, folder: Path) -> Iterator[Page]:
    """One that is well, one that is not, and one that is silent."""
    with ExitStack() as ending:
        for site, temperature in (("silent", 22.0), ("warm", 45.0), ("gh1", 22.0)):
            archive.add_user(site)
            archive.site = site
            journal = folder / f"{site}.sqlite"
            write(journal, scans_lately(temperature))
            if site == "silent":
                forward_once(archive, journal)
                archive.do("UPDATE forwarder SET heard_at = now() - INTERVAL '1 hour'")
            else:
                ending.enter_context(forwarder(archive, journal))
        page = ending.enter_context(fleet(archive))
        page.site("gh1", verdict="healthy", active_alarms=0)
        page.site("warm", verdict="critical", active_alarms=5)
        page.site("silent", is_live=False, last_verdict="healthy")
        yield page


def test_the_worst_first_and_a_click_away(
    browser: Browser, archive: Archive, tmp_path: Path
) -> None:
    with three_sites(archive, tmp_path) as served:
        with opened(browser, served.url) as page:
            names = page.locator(".fleet-site h2")
            expect(names).to_have_text(["warm", "silent", "gh1"])
            cards = page.locator(".fleet-site")
            expect(cards.nth(0)).to_contain_text("Critical")
            expect(cards.nth(0)).to_contain_text("5 alarms")
            expect(cards.nth(1)).to_contain_text("Silent since")
            expect(cards.nth(1)).to_contain_text("Last known: Healthy, No alarms")
            expect(cards.nth(1)).not_to_have_attribute("data-health", "healthy")
            expect(cards.nth(2)).to_contain_text("No alarms")
            picture(page, "light")
            page.keyboard.press("/")
            page.keyboard.type("wa")
            expect(names).to_have_text(["warm"])
            expect(page.get_by_role("status")).to_have_text("1 of 3 greenhouses shown")
            page.get_by_role("searchbox").fill("")
            page.get_by_role("button", name="Silent 1").click()
            expect(names).to_have_text(["silent"])
            page.get_by_role("button", name="Healthy 1").click()
            names.first.click()
            # The whole page of that greenhouse, below its path.
            expect(page).to_have_url(re.compile(r"/sites/gh1/"))
            expect(page.get_by_role("banner")).to_contain_text("gh1")
            expect(page.locator(".tag-table, table").first).to_contain_text("4")
            picture(page, "site")
        with opened(browser, f"{served.url}/sites/silent/") as page:
            expect(page.get_by_role("banner")).not_to_contain_text("Live", timeout=10_000)
            picture(page, "silent")
        with opened(browser, served.url, color_scheme="dark") as page:
            expect(page.locator(".fleet-site")).to_have_count(3)
            picture(page, "dark")
        phone = {"width": 390, "height": 800}
        with opened(browser, f"{served.url}?kiosk&lang=de", viewport=phone) as page:
            expect(page.get_by_role("heading", level=1)).to_have_text("Gewächshäuser")
            expect(page.get_by_role("searchbox")).to_have_count(0)
            expect(page.locator(".fleet-site")).to_have_count(3)
            width = page.evaluate("document.documentElement.scrollWidth")
            assert width <= 390
            picture(page, "kiosk")


def test_an_archive_without_greenhouses_and_one_that_is_down(browser: Browser) -> None:
    with server() as own:
        archive = Archive(own)
        archive.add_user("page", "lupin_page")
        with fleet(archive) as served, opened(browser, served.url) as page:
            expect(page.get_by_role("main")).to_contain_text("No greenhouse is forwarded")
            picture(page, "empty")
            own.stop()
            expect(page.get_by_role("alert")).to_contain_text("The archive has not answered since")
            own.start()
            expect(page.get_by_role("alert")).to_be_hidden()
            picture(page, "down")
            served.process.freeze()
            expect(page.get_by_role("alert")).to_contain_text("No connection to the server since")
            served.process.thaw()
            expect(page.get_by_role("alert")).to_be_hidden()


def test_a_thousand_are_shown_without_delay(browser: Browser, archive: Archive) -> None:
    archive.do(
        "INSERT INTO site SELECT 'gh' || n, '' FROM generate_series(1, 1000) AS n;"
        "INSERT INTO forwarder SELECT 'gh' || n, 'm', 1, now(), now() + INTERVAL '1 hour'"
        " FROM generate_series(1, 1000) AS n"
    )
    with fleet(archive) as served:
        served.site("gh1000", is_live=True)
        begun = "performance.now()"
        with opened(browser, served.url) as page:
            expect(page.locator(".fleet-site")).to_have_count(1000)
            print("painted after", page.evaluate(begun), "ms")
            page.get_by_role("searchbox").fill("gh77")
            expect(page.locator(".fleet-site")).to_have_count(11)
            picture(page, "thousand")
