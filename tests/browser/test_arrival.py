"""What the page shows as the greenhouse comes to be known: at once, in full, and honestly."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import expect

from tests.browser.hmi import OpenPage
from tests.support.domains import own_domain
from tests.support.messages import occupancy_grid, scan
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
