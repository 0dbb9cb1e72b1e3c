"""Outages: no stale data look fresh, and the page recovers without a reload."""

import re
import time
from pathlib import Path
from urllib.parse import urlsplit

from playwright.sync_api import expect

from tests.browser.hmi import PHONE, SERVER_GONE, WIDE, Hmi, OpenPage
from tests.browser.places import places
from tests.support.journal import SECOND, append
from tests.support.journal import scan as row
from tests.support.messages import occupancy_grid, scan
from tests.support.processes import lupin_twin, url_of
from tests.support.ros import Peer
from tests.support.web import bridge

CLOCK = re.compile(r"Last data at \d\d:\d\d:\d\d")


def expect_frozen(hmi: Hmi, why: str) -> None:
    """The page dims its last data, and shows since when and why."""
    banner = hmi.test_id("frozen")
    expect(banner).to_contain_text(CLOCK)
    expect(banner).to_contain_text(why)
    expect(hmi.app).to_have_attribute("data-fresh", "false")
    expect(hmi.page.locator("canvas[data-layer=pins]")).to_have_css("opacity", "0.45")


def expect_live(hmi: Hmi) -> None:
    """The page is live again, and it was not reloaded."""
    hmi.expect_phase("live")
    expect(hmi.test_id("frozen")).to_have_count(0)
    expect(hmi.page.locator("canvas[data-layer=pins]")).to_have_css("opacity", "1")
    assert hmi.page.evaluate("window.stayed") is True


def seqs(hmi: Hmi) -> list[int]:
    """The numbers of the state frames so far."""
    return [frame["seq"] for frame in hmi.frames if "seq" in frame]


def stay(hmi: Hmi) -> None:
    """Mark the page, so that a reload would be noticed."""
    hmi.page.evaluate("window.stayed = true")


def test_a_server_that_is_killed_and_restarts_with_other_tags(
    domain: int, open_page: OpenPage
) -> None:
    with lupin_twin(domain, "serve") as old:
        url = url_of(old)
        with Peer(domain) as peer:
            peer.publish_map(occupancy_grid([[0] * 6] * 6))
            peer.observe(
                scan("a", {"temperature": 20.0}, at=(1, 1)),
                scan("gone", {"temperature": 40.0}, at=(4, 4)),
            )
            hmi = open_page(url, "view=3,3,8&layers=map,field&sort=tag")
            stay(hmi)
            hmi.expect_rows("a", "gone")
            hmi.expect_samples(2)
            hot, floor, ground = (4.0, 4.0), (5.5, 0.5), (-0.5, 3.0)
            hmi.expect_pixels(lambda pixel: pixel != hmi.pixel(*floor), hot, what="the heat map")

            def many_frames() -> bool:
                peer.observe(scan("a", {"temperature": 20.0}))
                return seqs(hmi)[-1] >= 15

            hmi.expect(many_frames, "a number that the next server takes long to reach")
            old_seqs = seqs(hmi)
        old.kill()
    hmi.allow_noise(SERVER_GONE)
    hmi.expect_phase("reconnecting")
    expect_frozen(hmi, "Connection to the server lost")
    hmi.expect_rows("a", "gone")
    # On a phone, the banner leaves the map its room.
    hmi.resize(*PHONE.values())

    def has_room() -> bool:
        (frame,) = places(hmi, ".map-frame")
        return frame.bottom - frame.top >= 330

    hmi.expect(has_room, "a high map")
    # Nothing to do about old data: no line is kept for it.
    expect(hmi.page.locator(".health-strip .do-why")).to_be_visible()
    expect(hmi.page.locator(".health-strip .do-what")).to_be_hidden()
    hmi.resize(*WIDE.values())

    with (
        lupin_twin(domain, "serve", "--port", str(urlsplit(url).port)) as new,
        Peer(domain) as peer,
    ):
        assert url_of(new) == url
        peer.observe(scan("a", {"humidity": 61.0}))
        hmi.expect_rows("a")
        expect_live(hmi)
        expect(hmi.cell("a", "temperature")).to_contain_text("No sensor")
        expect(hmi.cell("a", "humidity")).to_have_text("61.0")
        # No heat map of the old greenhouse, and not its map either.
        expect(hmi.test_id("sample-count")).to_have_text("No tag contributes")
        hmi.expect(lambda: len(set(hmi.pixels([ground, hot, floor]))) == 1, "bare ground")
    assert min(seqs(hmi)[len(old_seqs) :]) < old_seqs[-1]


def test_a_clock_behind_the_recording_is_named_once_with_what_to_do_first(
    tmp_path: Path, open_page: OpenPage
) -> None:
    """As on a board that starts years ago: data arrives, but nobody knows how old it is."""
    journal = tmp_path / "journal.sqlite"
    append(journal, [row("1", time.time_ns() + 86_400 * SECOND, co2=5.0)])
    with bridge("--ros-args", "-p", f"journal:={journal}") as running:
        hmi = open_page(running.url, "list=alarms", viewport=PHONE)
        banners = hmi.page.locator(".banners")
        expect(banners).to_have_text(re.compile("^Set the twin’s clock.*nothing is recorded"))
        expect(banners).not_to_contain_text(re.compile(r"\dT\d"))
        box = banners.bounding_box()
        assert box is not None
        assert box["height"] < PHONE["height"] / 6
        expect(hmi.page.get_by_test_id("connection")).to_contain_text("Time unknown")
        expect(hmi.page.locator(".alarm-notes")).to_have_text(
            "While the time is unknown, alarms may be missing."
        )
        running.peer.observe(scan("1", {"co2": 7.0}))
        hmi.page.get_by_role("button", name=re.compile("Tags")).click()
        expect(hmi.cell("1", "co2")).to_have_text("7")
        age = hmi.row("1").locator(".cell-age")
        expect(age).to_have_text("unknown")
        assert age.evaluate("it => it.scrollWidth <= it.clientWidth"), "the word is cut"
