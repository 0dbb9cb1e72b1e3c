"""Bays, rows or zones of the greenhouse: the table by area, and the area of a tag."""

from playwright.sync_api import Route, expect

from tests.browser.greenhouse import TAGS
from tests.browser.hmi import WIDE, OpenPage
from tests.browser.places import place
from tests.browser.test_accessibility import violations
from tests.support.web import Bridge

AREAS = {"North bay": ["1", "9"], "South bay": ["3", "1*"]}


def with_areas(route: Route) -> None:
    answer = route.fetch()
    route.fulfill(response=answer, json={**answer.json(), "areas": AREAS})


def test_the_table_by_area_has_the_worst_first(greenhouse: Bridge, open_page: OpenPage) -> None:
    hmi = open_page(greenhouse.url, go=False, bypass_csp=True)
    hmi.page.route("**/api/sensors", with_areas)
    hmi.go("tag=10")
    hmi.expect_rows(*TAGS)
    expect(hmi.card("10").locator(".card-facts")).to_contain_text("AreaSouth bay")
    hmi.page.get_by_role("button", name="Columns and rows").click()
    # Where columns are dropped, a head brings none of them back.
    hmi.resize(1100, 800)
    columns = [place(each) for each in hmi.page.locator("thead th:visible").all()]
    hmi.page.get_by_role("checkbox", name="Group by area").check()
    expect(hmi.page.locator("tbody tr.area")).to_have_count(3)
    assert [place(each) for each in hmi.page.locator("thead th:visible").all()] == columns
    head = place(hmi.page.locator("tr.area h3").first)
    assert (head.left, head.right) == (columns[0].left, columns[-1].right)
    hmi.resize(**WIDE)
    hmi.page.keyboard.press("Escape")
    hmi.expect_rows("10", "3", "1", "9", "failed", "seen", "2")
    heads = hmi.page.locator("tbody tr.area")
    expect(heads).to_have_text(
        ["Critical South bay 2 tags", "Healthy North bay 2 tags", "Unknown No area 3 tags"]
    )
    expect(hmi.page.get_by_role("table").get_by_role("heading", level=3)).to_have_count(3)
    # A row does not repeat its head.
    expect(hmi.row("1").get_by_role("rowheader")).to_have_text("1", use_inner_text=True)
    # Heads are rows for counting, and cannot be chosen.
    expect(hmi.page.get_by_role("table")).to_have_attribute("aria-rowcount", str(len(TAGS) + 4))
    expect(heads.nth(1)).to_have_attribute("aria-rowindex", "5")
    expect(hmi.row("1")).to_have_attribute("aria-rowindex", "6")
    heads.nth(1).click()
    expect(hmi.card("10")).to_be_visible()
    hmi.row("3").get_by_role("button").focus()
    hmi.page.keyboard.press("Tab")
    expect(hmi.row("1").get_by_role("button")).to_be_focused()
    # The keys for the next tag follow the rows.
    for tag_id in ("3", "1"):
        hmi.page.keyboard.press("n")
        expect(hmi.row(tag_id)).to_have_attribute("data-selected", "true")
    assert violations(hmi) == []
    # Stored on this device.
    hmi.go()
    expect(heads).to_have_count(3)
    # Without named areas there is nothing to group by.
    hmi.page.unroute_all()
    hmi.page.reload()
    hmi.expect_rows(*TAGS)
    expect(heads).to_have_count(0)
    hmi.page.get_by_role("button", name="Columns and rows").click()
    expect(hmi.page.get_by_role("checkbox", name="Status")).to_be_visible()
    expect(hmi.page.get_by_role("checkbox", name="Group by area")).to_have_count(0)
