"""What the page shows as the greenhouse comes to be known: at once, in full, and honestly."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import expect

from tests.browser.hmi import OpenPage
from tests.support.domains import own_domain
from tests.support.messages import discovered, look, occupancy_grid, pose, scan
from tests.support.web import Bridge, bridge

SILENT = ("--ros-args", "-p", "state_publish_rate_hz:=0.01")


@pytest.fixture(scope="module")
def shared() -> Iterator[Bridge]:
    """One bridge for many tests, each with tags of its own."""
    with own_domain() as domain, bridge(domain=domain) as running:
        running.peer.publish_map(occupancy_grid([[0] * 8] * 8))
        running.peer.observe(scan("first", {"temperature": 20.0}, at=(1, 1)))
        running.tag("first")
        yield running


def test_a_late_page_shows_every_tag_at_once_while_the_twin_is_silent(
    domain: int, open_page: OpenPage
) -> None:
    ids = [str(i) for i in range(29)]
    with bridge(*SILENT, domain=domain) as running:
        running.peer.publish_map(occupancy_grid([[0] * 8] * 8))
        running.peer.observe(
            *(scan(i, {"temperature": 15.0 + int(i)}, at=(int(i) % 7, int(i) // 7)) for i in ids)
        )
        running.tag("28")
        hmi = open_page(running.url, "sort=tag")
        hmi.expect_rows(*ids)
        expect(hmi.cell("28", "temperature")).to_contain_text("43.0")
        hmi.expect_phase("live")
        hmi.expect_samples(29)
    # All of it was in the first state, which the page did not have to wait for.
    assert [frame["type"] for frame in hmi.frames[:2]] == ["status", "state"]
    assert [tag["tag_id"] for tag in hmi.frames[1]["state"]["tags"]] == ids


def test_the_table_stays_where_it_is_while_tags_arrive(domain: int, open_page: OpenPage) -> None:
    with bridge(domain=domain) as running:
        hmi = open_page(running.url)
        table = hmi.page.locator(".table-scroll")
        # Each comes above those that are there, as the robot meets them in no order.
        for first in range(60, 0, -20):
            ids = [str(first + i) for i in range(20)]
            running.peer.observe(*(scan(i, {"temperature": 20.0}, at=(1, 1)) for i in ids))
            expect(hmi.row(ids[-1])).to_be_attached()
            assert table.evaluate("table => table.scrollTop") == 0
        expect(hmi.row("20")).to_be_in_viewport()


def test_what_is_not_known_of_a_tag_is_said(shared: Bridge, open_page: OpenPage) -> None:
    shared.peer.observe(
        scan("lost", {"temperature": 24.0}),
        scan("broken", {"temperature": float("nan")}, at=(4, 2)),
        # The table has a column for a sensor only once a tag reports it.
        scan("humid", {"humidity": 60.0}, at=(4, 4)),
    )
    shared.peer.discover(discovered({"seen": pose(3, 3)}))
    hmi = open_page(shared.url)
    expect(hmi.row("seen")).to_have_attribute("data-pinned", "true")
    expect(hmi.row("seen").locator(".cell-age")).to_have_text("never")
    expect(hmi.cell("broken", "temperature")).to_have_text("failed")
    expect(hmi.cell("broken", "humidity")).to_contain_text("no sensor")
    row = hmi.row("lost")
    expect(row).to_contain_text("No pin")
    expect(row).to_have_attribute("data-pinned", "false")
    expect(hmi.cell("lost", "temperature")).to_have_text("24.0")
    row.get_by_role("button").click()
    expect(hmi.card("lost")).to_contain_text("No position known yet")


def test_a_pest_appears_on_map_and_table_and_a_clean_look_clears_it(
    shared: Bridge, open_page: OpenPage
) -> None:
    shared.peer.observe(scan("crop", {"temperature": 20.0}, at=(6, 6)))
    hmi = open_page(shared.url, "view=6,6,4&layers=pins")
    expect(hmi.row("crop")).to_have_attribute("data-pest", "false")
    hmi.expect_samples()
    before = hmi.settled_picture()

    shared.peer.observe(look("crop", "lupin", at=(6, 6), anomaly=True, bug_count=3))
    expect(hmi.row("crop")).to_have_attribute("data-pest", "true")
    expect(hmi.row("crop").locator(".why")).to_have_text("3 pests seen")
    ring = hmi.lasting_change(before)
    # A ring about the pin, with a sign that reaches beyond it.
    x, y = hmi.view().pixel(6, 6)
    assert ring.left < x - 14
    assert ring.right > x + 14
    assert ring.top < y - 14
    assert ring.bottom > y + 14

    shared.peer.observe(look("crop", "lupin", at=(6, 6), anomaly=False))
    expect(hmi.row("crop")).to_have_attribute("data-pest", "false")
    expect(hmi.row("crop").locator(".why")).to_have_count(0)
    hmi.expect_picture(before)


def test_what_comes_behind_the_first_view_is_asked_for_until_it_is_there(
    shared: Bridge, open_page: OpenPage
) -> None:
    hmi = open_page(shared.url)
    hmi.allow_noise("behind-.*js")
    hmi.page.route("**/assets/behind-*.js", lambda route: route.abort())
    hmi.go()
    expect(hmi.row("first")).to_be_attached()
    trouble = hmi.page.locator("[data-trouble=parts]")
    expect(trouble).to_contain_text("Part of the page has not loaded.")
    hmi.page.unroute("**/assets/behind-*.js")
    expect(hmi.test_id("timebar")).to_be_visible()
    expect(trouble).to_have_count(0)
