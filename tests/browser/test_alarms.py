"""Alarms in the page: they come by themselves, lead there, and what was seen stays seen."""

from __future__ import annotations

import re
from typing import Any

from playwright.sync_api import Locator, expect

from tests.browser.hmi import Hmi, OpenPage
from tests.support.messages import scan
from tests.support.waiting import wait_for
from tests.support.web import Bridge, bridge


def rows(hmi: Hmi, group: str) -> Locator:
    """The alarms of one group of the list, from the top."""
    return hmi.page.locator(f"[data-group={group}] li")


def icon(hmi: Hmi) -> str:
    """Where the tab's icon is from."""
    href = hmi.page.locator("link[rel=icon]").get_attribute("href")
    assert href is not None
    return href


def active(running: Bridge, count: int) -> list[dict[str, Any]]:
    """The bridge's active alarms, once there are so many."""

    def look() -> list[dict[str, Any]] | None:
        alarms: list[dict[str, Any]] = running.json("/api/alarms", active=1)["alarms"]
        return alarms if len(alarms) == count else None

    found = wait_for(look, f"{count} active alarms")
    assert found is not None
    return found


def test_an_alarm_comes_is_followed_seen_and_put_aside(domain: int, open_page: OpenPage) -> None:
    with bridge(domain=domain) as running:
        robot = running.peer
        robot.observe(scan("a", {"temperature": 22.0}, at=(1, 1)))
        hmi = open_page(running.url)
        hmi.expect_rows("a")
        hmi.page.keyboard.press("a")
        expect(hmi.page.locator("[data-note=none]")).to_have_text("No alarm is active")
        expect(hmi.page).to_have_title("Lupin twin")
        own_icon = icon(hmi)

        robot.observe(*[scan("a", {"temperature": value}) for value in (41.0, 43.5)])
        row = rows(hmi, "active")
        told = "Tag a: Temperature 43.5\u00a0°C, above 35.0 (critical)"
        expect(row).to_contain_text(told)
        # Not in the millisecond of the alarm, which is as fine as a link tells its moment.
        robot.observe(scan("a", {"temperature": 42.0}))
        running.tag("a", lambda tag: tag["readings"][0]["value"] == 42.0)
        expect(row).to_contain_text(told)
        expect(hmi.page).to_have_title("(1) Lupin twin")
        hmi.expect(lambda: icon(hmi).startswith("data:image/svg+xml"), "an icon that tells")
        expect(hmi.test_id("said-critical")).to_contain_text("New: Tag a: Temperature")
        expect(row).to_have_attribute("data-seen", "false")

        # To its place, its moment and its chart, by the keyboard alone; that is to have seen it.
        [alarm] = active(running, 1)
        hmi.tab_to(row.locator(".alarm-go"))
        hmi.page.keyboard.press("Enter")
        raised_s = alarm["raised_at"]["sec"] + alarm["raised_at"]["nanosec"] / 1e9
        shown = re.compile(rf"^{int(raised_s)}\.\d+$|^{int(raised_s)}$")
        expect(hmi.app).to_have_attribute("data-moment", shown)
        expect(hmi.card("a")).to_contain_text("43.5")
        expect(hmi.test_id("card-chart")).to_have_attribute("data-state", "ready")
        expect(hmi.page).to_have_title(re.compile(r"^[^(]* \(past\) · Lupin twin$"))
        hmi.expect(lambda: icon(hmi) == own_icon, "its own icon")
        hmi.page.keyboard.press("l")
        expect(hmi.app).to_have_attribute("data-moment", "now")
        hmi.expect(lambda: "at=" not in hmi.address(), "an address of now")

        # Seen and put aside: in this browser, after a reload as well.
        hmi.page.get_by_role("button", name="Put aside: Tag a").click()
        hmi.page.get_by_role("button", name="For 15 min").click()
        expect(rows(hmi, "shelved")).to_contain_text("put aside until")
        hmi.page.reload()
        hmi.page.keyboard.press("a")
        expect(rows(hmi, "shelved")).to_contain_text("put aside until")
        hmi.page.get_by_role("button", name="Take back: Tag a").click()
        expect(row).to_have_attribute("data-seen", "true")
        expect(hmi.page).to_have_title("Lupin twin")

        # Cleared by itself it stays listed, with its end.
        robot.observe(*[scan("a", {"temperature": 22.0})] * 2)
        over = rows(hmi, "over")
        expect(over).to_contain_text(re.compile(r"\d\d:\d\d:\d\d until \d\d:\d\d:\d\d"))
        expect(row).to_have_count(0)


def test_sound_and_notification_are_had_on_wish_alone(house: Bridge, open_page: OpenPage) -> None:
    hmi = open_page(house.url, permissions=["notifications"])
    hmi.page.keyboard.press("a")
    hmi.page.get_by_role("button", name="Tell me of alarms").click()
    sound, notify = hmi.page.get_by_label("Sound"), hmi.page.get_by_label("Notification")
    expect(sound).not_to_be_checked()
    expect(notify).not_to_be_checked()
    notify.check()
    sound.check()
    expect(notify).to_be_checked()
    expect(hmi.page.locator("[data-way=sound] p")).to_contain_text("at most one in 10 s")
    hmi.page.reload()
    hmi.page.keyboard.press("a")
    hmi.page.get_by_role("button", name="Tell me of alarms").click()
    expect(sound).to_be_checked()
    expect(notify).to_be_checked()
