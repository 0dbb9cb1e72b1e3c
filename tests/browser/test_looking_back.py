"""The page looks back: it shows the journal's data, and marks them clearly as past."""

import re
import time
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import pytest
from playwright.sync_api import expect

from lupin_twin.core.state import Write
from lupin_twin.journal.fold import state_at
from lupin_twin.journal.runs import Clock
from lupin_twin.journal.schema import open_reader
from tests.browser.hmi import PHONE, Hmi, OpenPage, point, press_at, slider
from tests.browser.places import places
from tests.browser.test_accessibility import violations
from tests.support.journal import SECOND, append, inspection, pin, scan
from tests.support.messages import scan as observed
from tests.support.web import Bridge, bridge

TAGS: Final = ("a", "b", "c")
PLACES: Final = {"a": 1.0, "b": 3.0, "c": 5.0}
EVERY_S: Final = 30
SCANS: Final = 90
# No past scan has this reading, so that now and then differ.
NOW_READS: Final = 25.5

# The moment that the page shows, and its content, at each change.
WATCH: Final = """
window.seen = [];
(function watch() {
  const app = document.querySelector('[data-testid=app]');
  const cell = document.querySelector('tr[data-tag-id=a] td[data-sensor=temperature] .reading');
  const told = app?.dataset.moment;
  const now = JSON.stringify([told, cell ? cell.textContent : null, document.title]);
  if (told && window.seen.at(-1) !== now) window.seen.push(now);
  requestAnimationFrame(watch);
})();
"""


@dataclass(frozen=True)
class Hour:
    """A twin with 45 minutes of past, which goes on."""

    bridge: Bridge
    journal: Path
    begun_s: int

    def read_then(self, at_s: float) -> dict[str, str]:
        """The journal's temperatures as of a moment, as the table writes them."""
        with closing(open_reader(self.journal)) as connection:
            tags = state_at(connection, round(at_s * 1000) * 1_000_000, "map").tags
        return {tag.tag_id: f"{tag.readings[0].value:.1f}" for tag in tags if tag.readings}


@pytest.fixture(scope="module")
def hour(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Hour]:
    journal = tmp_path_factory.mktemp("hour") / "journal.sqlite"
    begun_s = int(time.time()) - EVERY_S * SCANS
    begun_ns = begun_s * SECOND
    rows: list[Write] = [pin(tag, begun_ns, x=PLACES[tag]) for tag in TAGS]
    rows.append(inspection("b", begun_ns + 600 * SECOND, anomaly=True))
    rows += [inspection("b", begun_ns + second * SECOND) for second in (900, 901)]
    rows += [
        scan(tag, begun_ns + number * EVERY_S * SECOND, temperature=18.0 + number % 40 / 10)
        for number in range(SCANS)
        for tag in TAGS
    ]
    append(journal, rows, Clock(begun_ns, begun_ns, is_simulated=False))
    with bridge("--ros-args", "-p", f"journal:={journal}") as running:
        running.peer.observe(*(observed(tag, {"temperature": NOW_READS}) for tag in TAGS))
        for tag in TAGS:
            running.tag(tag, lambda tag: tag["readings"][0]["value"] == NOW_READS)
        yield Hour(running, journal, begun_s)


@pytest.fixture
def page(hour: Hour, open_page: OpenPage) -> Hmi:
    """A page with the last hour below its map."""
    hmi = open_page(hour.bridge.url, go=False)
    hmi.page.add_init_script(WATCH)
    hmi.go("period=hour")
    hmi.expect_rows(*TAGS)
    hmi.expect_samples(3)
    expect(hmi.test_id("timebar")).to_have_attribute("data-state", "ready")
    return hmi


def moment(hmi: Hmi) -> float | None:
    """The moment that the page names; None: now."""
    reported = hmi.app.get_attribute("data-moment")
    assert reported is not None
    return None if reported == "now" else float(reported)


def settled(hmi: Hmi) -> float | None:
    """The moment that is shown once it is the wanted one."""
    expect(hmi.page.locator(".timebar-cursor")).to_have_attribute("data-awaited", "false")
    return moment(hmi)


def expect_past(hmi: Hmi) -> float:
    """Wait until a past moment is shown, with every label; that moment."""
    expect(hmi.app).to_have_attribute("data-past", "true")
    at = settled(hmi)
    assert at is not None
    expect(hmi.test_id("past-header")).to_contain_text("Past")
    when = hmi.test_id("past-header").locator("strong").inner_text()
    expect(hmi.test_id("past-frame")).to_be_attached()
    # The number of active alarms is the current one, and comes before it.
    title = re.escape(f"{when} (past) · Lupin twin")
    expect(hmi.page).to_have_title(re.compile(rf"^(\([1-9]\d*\) )?{title}$"))
    expect(hmi.test_id("connection")).not_to_contain_text("Live")
    return at


def expect_now(hmi: Hmi) -> None:
    expect(hmi.app).to_have_attribute("data-moment", "now")
    expect(hmi.test_id("past-header")).to_have_count(0)
    expect(hmi.test_id("past-frame")).to_have_count(0)
    expect(hmi.page).to_have_title(re.compile(r"^(\([1-9]\d*\) )?Lupin twin$"))
    expect(hmi.cell("a", "temperature")).to_have_text("25.5")


def check_seen(hmi: Hmi, hour: Hour) -> set[float]:
    """Compare all that the page has shown with the journal; the moments that it showed."""
    moments = set()
    for line in hmi.page.evaluate("window.seen.map((each) => JSON.parse(each))"):
        reported, cell, title = line
        if reported == "now":
            assert cell in (None, "25.5"), line
            assert title == "Lupin twin", line
        else:
            assert cell in (None, hour.read_then(float(reported)).get("a")), line
            moments.add(float(reported))
    return moments


def test_dragging_shows_each_moment_as_in_the_journal(page: Hmi, hour: Hour) -> None:
    mouse = page.page.mouse
    mouse.move(*point(page, 0.95))
    mouse.down()
    expect_past(page)  # otherwise the next may take its place
    for share in (0.9, 0.7, 0.5, 0.4):
        mouse.move(*point(page, share), steps=5)
        at = expect_past(page)
        then = hour.read_then(at)
        for tag in TAGS:
            expect(page.cell(tag, "temperature")).to_have_text(then[tag])
        # Everything follows: the field, the ages as of then.
        expect(page.test_id("sample-count")).to_have_text("3 tags contribute")
        age = int(at - hour.begun_s) % EVERY_S
        expect(page.row("a").locator(".cell-age")).to_have_text(f"{age}\u00a0s")
    mouse.up()
    assert len(check_seen(page, hour)) > 4


def test_the_bar_is_from_the_log_until_now_and_before_the_log_is_nothing(
    page: Hmi, hour: Hour
) -> None:
    press_at(page, 0.6)
    expect_past(page)
    press_at(page, 0.999)
    expect_now(page)
    press_at(page, 0.01)
    assert expect_past(page) > hour.begun_s  # the log is shorter than an hour
    page.turn(f"at={hour.begun_s - 60}&period=hour")
    notice = page.test_id("notice")
    expect(notice).to_have_attribute("data-notice", "past-nothing")
    expect(notice).to_contain_text("Recorded data begins at")
    assert page.rows() == []
    page.page.get_by_role("button", name="Back to live").click()
    expect_now(page)
    check_seen(page, hour)

    # Pests and cards are those of the moment.
    page.turn(f"tag=b&at={hour.begun_s + 700}&period=hour")
    expect_past(page)
    expect(page.card("b")).to_contain_text(re.compile("pests? seen", re.IGNORECASE))
    expect(page.card("b").locator("[data-sensor=temperature] strong")).to_have_text("20.3\u00a0°C")
    # What was wrong then is shown; its open actions are not.
    expect(page.test_id("health-driver")).to_contain_text(re.compile("pests? seen", re.IGNORECASE))
    expect(page.page.locator(".do-what strong")).to_have_count(0)
    # Nor is a line kept for them.
    (todo,) = places(page, ".health .do-now")
    assert todo.bottom - todo.top < 40
    page.turn(f"tag=b&at={hour.begun_s + 1000}&period=hour")
    expect_past(page)
    expect(page.card("b")).not_to_contain_text(re.compile("pests? seen", re.IGNORECASE))


def test_axe_has_no_objection_to_the_past(hour: Hour, open_page: OpenPage) -> None:
    past = f"at={hour.begun_s + 700}&tag=b&period=hour"
    hmi = open_page(hour.bridge.url, past, bypass_csp=True)
    expect_past(hmi)
    hmi.page.get_by_role("button", name="What the marks mean").click()
    assert violations(hmi) == []
    hmi.page.set_viewport_size({"width": PHONE["width"], "height": PHONE["height"]})
    assert violations(hmi) == []
    hmi.card("b").get_by_role("button", name="Close").click()
    hmi.page.get_by_label("Period", exact=True).select_option("own")
    assert violations(hmi) == []


def test_a_phone_has_the_menu_and_every_count_on_its_screen(
    hour: Hour, open_page: OpenPage
) -> None:
    hmi = open_page(hour.bridge.url, f"at={hour.begun_s + 700}", viewport=PHONE)
    expect(hmi.app).to_have_attribute("data-past", "true")
    hmi.expect_parts()
    # As wide as the label of a simulation makes it.
    hmi.page.evaluate(
        """() => document.querySelector('.past-header').insertAdjacentHTML('afterend',
             '<div class="origin"><span class="origin-word">Simulated</span></div>')"""
    )
    buttons = hmi.page.get_by_role("button", name="Menu").or_(hmi.page.locator(".pane-tabs button"))
    for width in (360, 390):
        hmi.resize(width, 740)
        for each in buttons.all():
            expect(each).to_be_in_viewport(ratio=1)
            assert each.evaluate("(e) => e.scrollWidth <= e.clientWidth"), width
    # Beside a card, the bar is the way through the past; a map would be a stamp.
    hmi.turn(f"at={hour.begun_s + 700}&tag=a")
    expect(hmi.card("a")).to_be_in_viewport()
    expect(hmi.map).to_be_hidden()
    expect(slider(hmi)).to_be_in_viewport(ratio=1)
    # On its side, the bar is beside the map, and all of the menu in sight.
    hmi.turn(f"at={hour.begun_s + 700}")
    hmi.resize(740, 360)
    expect(slider(hmi)).to_be_in_viewport(ratio=1)
    buttons.first.click()
    for entry in hmi.page.locator(".menu-list > *").all():
        expect(entry).to_be_in_viewport(ratio=1)
