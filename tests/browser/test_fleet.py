"""The page over all greenhouses, in a real browser, over a real archive."""

import re
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Locator, ViewportSize, expect
from playwright.sync_api import Page as BrowserPage

from lupin_twin.core.parameters import World
from tests.browser.places import place
from tests.support.archive import Archive, forward_once, forwarder
from tests.support.fleet import Page, fleet, recent_scans, wall, write
from tests.support.journal import recording, scan
from tests.support.postgres import server
from tests.support.waiting import wait_for

PHONE: ViewportSize = {"width": 390, "height": 800}
HOUR_NS = 3_600_000_000_000


@contextmanager
def opened(browser: Browser, url: str, **context: object) -> Iterator[BrowserPage]:
    with browser.new_context(**context) as own:  # type: ignore[arg-type]
        page = own.new_page()
        problems: list[str] = []
        page.on("pageerror", lambda error: problems.append(str(error)))
        page.goto(url)
        yield page
        assert not problems


def expect_no_wider_than_a_phone(page: BrowserPage) -> None:
    """Nothing is wider than a phone's screen."""
    page.set_viewport_size(PHONE)
    page.wait_for_function(f"innerWidth === {PHONE['width']}")
    assert page.evaluate("document.documentElement.scrollWidth") <= PHONE["width"]


def after_status(row: Locator) -> int:
    """How far a greenhouse's name is from the status before it, pixels."""
    status = row.locator(".health-mark span")
    return place(row.locator(".fleet-alarm-site")).left - place(status).right


@contextmanager
def three_sites(archive: Archive, folder: Path) -> Iterator[Page]:
    """One healthy, one not, and one silent."""
    with ExitStack() as ending:
        for site, temperature in (("silent", 22.0), ("warm", 45.0), ("gh1", 22.0)):
            archive.add_user(site)
            archive.site = site
            journal = folder / f"{site}.sqlite"
            write(journal, recent_scans(temperature))
            if site == "silent":
                forward_once(archive, journal)
                archive.do("UPDATE forwarder SET heard_at = now() - INTERVAL '1 hour'")
            else:
                ending.enter_context(forwarder(archive, journal))
        page = ending.enter_context(fleet(archive))
        page.site("gh1", verdict="healthy", active_alarms=0)
        page.site("warm", verdict="critical", active_alarms=5)
        page.site("silent", is_live=False, last_verdict="healthy", active_alarms=1)
        yield page


@pytest.fixture(scope="module")
def sites(shared_archive: Archive, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    """These three, for tests whose changes no other test reads."""
    with three_sites(shared_archive, tmp_path_factory.mktemp("sites")) as served:
        yield served


def test_the_worst_first_and_a_click_away(browser: Browser, sites: Page) -> None:
    with opened(browser, sites.url) as page:
        names = page.locator(".fleet-name")
        expect(names).to_have_text(["warm", "silent", "gh1"])
        cards = page.locator(".fleet-site")
        expect(cards.nth(0)).to_contain_text("Critical")
        expect(cards.nth(0)).to_contain_text("5 alarms")
        # Few greenhouses: what to do, too, and a large map.
        expect(cards.nth(0)).to_contain_text("Temperature too high · 5\u00a0tagsVentilate or shade")
        expect(cards.nth(1)).to_contain_text("Silent since")
        expect(cards.nth(1)).to_contain_text("Last known: Healthy")
        # That it is silent.
        expect(cards.nth(1)).to_contain_text("1 alarm")
        # The positions of the tags: fetched, and as large as their placeholder.
        for card in (cards.nth(0), cards.nth(2)):
            image = card.locator("img.fleet-map")
            expect(image).to_have_js_property("complete", value=True)
            assert image.evaluate("image => image.naturalWidth > 0")
            assert image.evaluate("image => Math.max(image.width, image.height) > 88")
        expect(cards.nth(1)).not_to_have_attribute("data-health", "healthy")
        expect(cards.nth(2)).to_contain_text("No alarms")
        # No row has a source; from two groups on, there are headings.
        expect(page.locator(".fleet-origin")).to_have_count(0)
        expect(page.locator(".fleet-group")).to_have_count(0)
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
        # The link back pushes nothing out of sight.
        assert page.evaluate("document.documentElement.scrollHeight <= innerHeight")
        page.get_by_role("link", name="All greenhouses").click()
        expect(page.get_by_role("heading", level=1)).to_have_text("Greenhouses")
    with opened(browser, f"{sites.url}/sites/gh1/?kiosk") as page:
        expect(page.get_by_role("banner")).to_contain_text("gh1")
        expect(page.locator(".fleet-back")).to_have_count(0)
    with opened(browser, f"{sites.url}/sites/silent/") as page:
        expect(page.get_by_role("banner")).not_to_contain_text("Live", timeout=10_000)
    with opened(browser, f"{sites.url}?lang=de", viewport=PHONE) as page:
        expect(page.locator(".fleet-site")).to_have_count(3)
        for words in page.locator(".fleet-filters").all():
            assert words.evaluate("it => it.scrollWidth <= it.clientWidth"), "a tab is cut"
    with opened(browser, f"{sites.url}?kiosk&lang=de", viewport=PHONE) as page:
        expect(page.get_by_role("heading", level=1)).to_have_text("Gewächshäuser")
        expect(page.get_by_role("searchbox")).to_have_count(0)
        expect(page.locator(".fleet-site")).to_have_count(3)
        expect_no_wider_than_a_phone(page)


def test_alarms_of_all_greenhouses_are_counted_listed_and_a_click_away(
    browser: Browser, archive: Archive, tmp_path: Path
) -> None:
    with three_sites(archive, tmp_path) as served:
        with opened(browser, served.url) as page:
            page.clock.install()
            page.reload()
            expect(page).to_have_title("(6) Greenhouses")
            page.get_by_role("button", name="Alarms 6").click()
            rows = page.locator(".fleet-alarm-list li")
            expect(rows).to_have_count(6)
            silence = rows.filter(has_text="silent")
            expect(silence).to_have_attribute("data-live", "false")
            expect(rows.first).to_contain_text("warm")
            expect(rows.first).to_contain_text("Temperature above 35")
            expect(rows.first).to_contain_text("now 45.0\u00a0°C")
            # The filters of the cards.
            page.get_by_role("searchbox").fill("gh1")
            expect(rows).to_have_count(0)
            expect(page.get_by_role("main")).to_contain_text("No alarms")
            expect(page).to_have_title("(6) Greenhouses")
            page.get_by_role("searchbox").fill("warm")
            expect(rows).to_have_count(5)
            # A resolved alarm leaves the cards, the count, the title and the list.
            now_ns = wall().stamp_ns
            journal = tmp_path / "warm.sqlite"
            write(journal, [scan("0", now_ns + n, temperature=22.0) for n in range(3)])
            expect(page).to_have_title("(5) Greenhouses")
            expect(page.get_by_role("button", name="Alarms 5")).to_be_visible()
            expect(rows).to_have_count(4)
            # Its notes are beside it.
            answer = partial(served.http.get, "/api/alarms")
            name = answer().json()["alarms"][0]["id"]
            archive.do(
                f"INSERT INTO note VALUES ('warm', 'n1', {now_ns}, 'Anna', 'acknowledge',"
                f" 'alarm:{name}', '', NULL)"
            )
            wait_for(lambda: "Anna" in answer().text, "it at the server")
            page.clock.fast_forward(10_000)
            # After those that nobody has acknowledged.
            expect(rows.last).to_contain_text("acknowledged by Anna,")
            # A shelved one is in a list of its own, and in no count, as on its own page.
            archive.do(
                f"INSERT INTO note VALUES ('warm', 'n2', {now_ns}, 'Ben', 'shelve',"
                f" 'alarm:{name}', 'fan ordered', {now_ns + HOUR_NS})"
            )
            expect(page).to_have_title("(4) Greenhouses")
            page.clock.fast_forward(10_000)
            shelved = page.get_by_role("group").filter(has_text="Shelved (1)")
            shelved.locator("summary").click()
            said = re.compile("shelved by Ben until .*: fan ordered")
            expect(shelved.locator("li")).to_contain_text(said)
            expect(page.locator(".fleet-alarm-list").first.locator("li")).to_have_count(3)
            expect_no_wider_than_a_phone(page)
            page.get_by_role("searchbox").fill("")
            expect(silence).to_be_visible()
            assert after_status(silence) == after_status(rows.first)
            tag = rows.first.locator("span", has_text=re.compile(r"^Tag \d$")).inner_text()
            rows.first.get_by_role("link").click()
            expect(page).to_have_url(re.compile(r"/sites/warm/.*#.*at=\d+"))
            # Its card, as of that moment.
            expect(page.get_by_role("complementary", name=tag)).to_be_visible()
            expect(page.locator(".app")).to_have_attribute("data-past", "true")
        with opened(browser, f"{served.url}?kiosk") as page:
            expect(page.get_by_role("banner")).to_contain_text("4 alarms")


def test_one_sensor_of_several_greenhouses_with_the_outlier_first(
    browser: Browser, archive: Archive, tmp_path: Path
) -> None:
    temperatures = {"gh1": 20.0, "gh2": 21.0, "gh3": 22.0, "odd": 33.0}
    # The same period for all: an hour may end meanwhile.
    now_ns = wall().stamp_ns
    for site, temperature in temperatures.items():
        journal = tmp_path / f"{site}.sqlite"
        write(
            journal,
            [
                scan("0", now_ns - hours * HOUR_NS, temperature=temperature + hours % 5)
                for hours in range(20, 0, -1)
            ],
        )
        forward_once(archive.of_site(site), journal)
    archive.do("UPDATE forwarder SET heard_at = now() - INTERVAL '1 hour'")
    with fleet(archive) as served:
        for site in temperatures:
            served.site(site, active_alarms=1 if site != "odd" else 2)
        with opened(browser, served.url) as page:
            page.get_by_role("button", name="Compare").click()
            rows = page.locator(".fleet-table tbody tr")
            expect(rows.locator("th a")).to_have_text(["odd", "gh1", "gh2", "gh3"])
            expect(rows.first).to_contain_text("odd (last known)")
            expect(rows.first).to_contain_text("35.0\u00a0°C")
            expect(rows.first).to_contain_text("11.5\u00a0°C")
            expect(page.get_by_test_id("plot").locator("canvas")).to_be_visible()
            expect(page.get_by_role("checkbox", name="Show odd")).to_be_checked()
            expect(page.get_by_role("checkbox", name="Show gh3")).not_to_be_checked()
            page.get_by_role("checkbox", name="Show gh3").check()
            expect(page.get_by_role("checkbox", name="Show gh3")).to_be_checked()
            # The same choice of greenhouses as for the cards.
            page.get_by_role("searchbox").fill("gh")
            expect(rows.locator("th a")).to_have_text(["gh1", "gh3", "gh2"])
            page.get_by_role("button", name="Last week").click()
            expect(rows.locator("th a")).to_have_text(["gh1", "gh3", "gh2"])
            page.get_by_label("Sensor").select_option("Humidity")
            expect(rows.locator("td").nth(1)).to_have_text("–")
            expect_no_wider_than_a_phone(page)


def test_a_row_for_each_greenhouse_leads_to_its_shift_report(
    browser: Browser, sites: Page, shared_archive: Archive
) -> None:
    now_ns = wall().stamp_ns
    shared_archive.do(
        f"INSERT INTO note VALUES ('warm', 'n1', {now_ns - 10**9}, 'Anna', 'comment', 'tag:1',"
        f" 'vents <b>checked</b>', NULL), ('gh1', 'n1', {now_ns}, 'Ben', 'acknowledge',"
        " 'alarm:x', '', NULL), ('gh1', 'n2', 1, 'Cem', 'withdraw', 'note:n1', '', NULL)"
    )
    with opened(browser, sites.url) as page:
        page.get_by_role("button", name="Shift report").click()
        rows = page.get_by_role("table").first.locator("tbody tr")
        notes = page.get_by_role("table", name="Newest notes").locator("tbody tr")
        expect(notes).to_have_count(2)
        expect(notes.nth(0)).to_contain_text("Benalarm acknowledged (withdrawn by Cem)")
        expect(notes.nth(1)).to_contain_text("warmAnnaTag 1: vents <b>checked</b>")
        expect(rows.locator("th")).to_have_text(["warm", "silent", "gh1"])
        requested = sites.http.get("/api/report").json()["sites"]
        scans = next(each["scans"] for each in requested if each["site"] == "warm")
        assert scans > 0
        expect(rows.first.locator("td").first).to_have_text(f"{scans:,}")
        expect(rows.first.locator("td").nth(4)).to_have_text("5")
        expect(rows.nth(1).locator("td").nth(4)).to_have_text("1 (last known)")
        # The choice of greenhouses and of the period.
        page.get_by_role("searchbox").fill("warm")
        expect(rows).to_have_count(1)
        with page.expect_response(re.compile(r"/api/report\?from=\d+&sites=warm$")):
            page.get_by_role("button", name="Last 24 hours").click()
        expect(notes).to_have_count(1)
        page.get_by_role("searchbox").fill("")
        expect(rows).to_have_count(3)
        expect_no_wider_than_a_phone(page)
        hint = page.get_by_text(re.compile("^Counted in whole hours.*of that greenhouse.$"))
        assert place(hint).right <= PHONE["width"]
        rows.first.get_by_role("link").click()
        address = r"/sites/warm/api/report\.html\?from=.*&lang=en&time_zone=.+$"
        expect(page).to_have_url(re.compile(address))
        expect(page.get_by_role("heading", level=1)).to_contain_text("report")


def test_groups_fold_and_are_found_by_their_name(browser: Browser, archive: Archive) -> None:
    archive.do(
        "INSERT INTO site VALUES ('north-1', 'Noord 1'), ('north-2', ''), ('south-1', ''),"
        " ('south-2', ''), ('alone', '')"
    )
    with fleet(archive) as served:
        served.site("south-2")
        with opened(browser, served.url) as page:
            names = page.locator(".fleet-name")
            groups = page.locator(".fleet-group")
            expect(groups.locator("h2")).to_have_text(["Other greenhouses", "north", "south"])
            expect(names).to_have_text(["alone", "Noord 1", "north-2", "south-1", "south-2"])
            groups.nth(1).locator("summary").click()
            expect(names.nth(1)).to_be_hidden()
            expect(names.nth(3)).to_be_visible()
            page.get_by_role("searchbox").fill("south-")
            expect(names).to_have_text(["south-1", "south-2"])
            expect(page.get_by_role("status")).to_have_text("2 of 5 greenhouses shown")
        with opened(browser, f"{served.url}?kiosk&group=north") as page:
            expect(page.locator(".fleet-name")).to_have_text(["Noord 1", "north-2"])


def test_simulated_data_are_marked(browser: Browser, archive: Archive, tmp_path: Path) -> None:
    journal = tmp_path / "journal.sqlite"
    with recording(journal, wall(), world=World("simulated")) as twin:
        for row in recent_scans():
            twin.write(row)
    forward_once(archive, journal)
    with fleet(archive) as served:
        served.site("gh1", origin="simulated")
        with opened(browser, served.url) as page:
            expect(page.locator(".fleet-site")).to_contain_text("Simulated")
            page.locator(".fleet-name").click()
            expect(page.get_by_test_id("origin")).to_contain_text("Simulated")


def test_an_archive_without_greenhouses_and_one_that_is_down(browser: Browser) -> None:
    with server() as own:
        archive = Archive(own)
        archive.add_user("page", "lupin_page")
        with fleet(archive) as served, opened(browser, served.url) as page:
            expect(page.get_by_role("main")).to_contain_text("No greenhouse sends data")
            archive.do(
                "INSERT INTO site VALUES ('gh1', '');"
                "INSERT INTO forwarder VALUES ('gh1', 'm', 1, now(), now() + INTERVAL '1 hour')"
            )
            page.clock.install()
            page.reload()
            card = page.locator(".fleet-site")
            expect(card).to_have_attribute("data-live", "true")
            own.stop()
            expect(page.get_by_role("alert")).to_contain_text("The archive has not answered since")
            expect(card).to_contain_text("As of")
            expect(card).to_have_attribute("data-live", "false")
            own.start()
            expect(page.get_by_role("alert")).to_be_hidden()
            served.process.freeze()
            page.clock.fast_forward(12_000)
            expect(page.get_by_role("alert")).to_contain_text("No connection to the server since")
            expect(card).to_contain_text("As of")
            expect(card).to_have_attribute("data-live", "false")
            served.process.thaw()
            expect(page.get_by_role("alert")).to_be_hidden()
