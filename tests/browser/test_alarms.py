"""Alarms in the page: they appear by themselves, in their current state."""

from __future__ import annotations

import itertools
import re
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from playwright.sync_api import Locator, expect

from tests.browser.hmi import PHONE, SERVER_GONE, WIDE, Hmi, OpenPage
from tests.browser.places import LINES, out_of_reach, place, places, words_below
from tests.support.messages import scan
from tests.support.waiting import wait_for
from tests.support.web import Bridge, bridge


def rows(hmi: Hmi, group: str) -> Locator:
    """The alarms of one group of the list, from the top."""
    return hmi.page.locator(f"[data-group={group}] [data-alarm]")


def act(hmi: Hmi, tag: str, what: str) -> None:
    """Choose an action from the menu of a tag's row."""
    hmi.page.get_by_role("button", name=f"Actions: Tag {tag}").click()
    hmi.page.locator(".row-actions").get_by_role("button", name=what, exact=True).click()


def active(running: Bridge, count: int) -> list[dict[str, Any]]:
    """The bridge's active alarms, once there are that many."""

    def check() -> list[dict[str, Any]] | None:
        alarms: list[dict[str, Any]] = running.json("/api/alarms", active=1)["alarms"]
        return alarms if len(alarms) == count else None

    found = wait_for(check, f"{count} active alarms")
    assert found is not None
    return found


def warm(tag_id: str, temperature: float, **options: Any) -> Any:
    """A scan by day: at night other ranges apply."""
    return scan(tag_id, {"temperature": temperature, "light": 900.0}, **options)


def open_resolved(hmi: Hmi, count: int) -> None:
    """Show the resolved alarms, once there are that many."""
    name = f"Resolved in the last 24 h ({count})"
    hmi.page.get_by_role("button", name=name).click()


def leave(hmi: Hmi) -> None:
    """Move the pointer off the list: changes held back under it are applied."""
    hmi.page.mouse.move(0, 0)


def fact(row: Locator, name: str) -> Locator:
    """One of a row's values: "now" or "worst"."""
    return row.locator(f"[data-fact={name}]")


def test_an_alarm_appears_is_acknowledged_and_resolved(domain: int, open_page: OpenPage) -> None:
    with bridge(domain=domain) as running:
        robot = running.peer
        robot.observe(warm("a", 22.0, at=(1, 1)))
        hmi = open_page(running.url)
        hmi.expect_rows("a")
        hmi.page.keyboard.press("a")
        expect(hmi.page.locator("[data-note=none]")).to_have_text("No alarm is active")
        expect(hmi.page).to_have_title("Lupin twin")

        robot.observe(*[warm("a", value) for value in (41.0, 43.5)])
        row = rows(hmi, "active")
        expect(row).to_contain_text("Tag a: Temperature above 35.0\u00a0°C")
        expect(hmi.page).to_have_title("(1) Lupin twin")
        expect(hmi.test_id("announced-critical")).to_contain_text("New: Tag a: Temperature above")
        expect(row).to_have_attribute("data-acknowledged", "false")
        # A long value leaves the text beside it uncovered.
        hmi.resize(1024, 768)
        gap = """row => {
          const [text, value] = ['.alarm-text > :first-child', '[data-fact=now] > :first-child']
            .map((each) => row.querySelector(each));
          const range = document.createRange();
          const box = (it) => (range.selectNodeContents(it), range.getBoundingClientRect());
          const { textContent } = value;
          value.textContent = 'now just below a limit of 18.0 °C, and more';
          const room = box(value).left - box(text).right;
          value.textContent = textContent;
          return room; }"""
        assert row.evaluate(gap) >= 0
        hmi.resize(**WIDE)

        hmi.page.get_by_role("button", name="Acknowledge: Tag a").click()
        expect(row).to_have_attribute("data-acknowledged", "true")
        # On a phone it covers no heading, not even that of an open menu, and no row's words.
        hmi.resize(**PHONE)
        hmi.page.get_by_role("button", name="Actions: Tag a").click()
        assert out_of_reach(hmi, "[data-line=done] button") == []
        line, words = places(hmi, "[data-line=done]", ".alarm-times .health-mark")
        assert line.bottom <= words.top + 2
        hmi.resize(**WIDE)
        hmi.page.keyboard.press("Escape")
        act(hmi, "a", "Unacknowledge")
        expect(row).to_have_attribute("data-acknowledged", "false")

        # Once resolved it stays listed, behind a button, with its end.
        leave(hmi)
        robot.observe(*[warm("a", 22.0)] * 2)
        open_resolved(hmi, 1)
        expect(rows(hmi, "resolved")).to_contain_text(re.compile(r"resolved \d\d:\d\d"))
        # On paper as well, without its actions.
        hmi.page.emulate_media(media="print")
        expect(rows(hmi, "resolved")).to_be_visible()
        expect(hmi.page.get_by_role("button", name="Acknowledge")).to_have_count(0)
        hmi.page.emulate_media(media="screen")
        expect(row).to_have_count(0)
        expect(hmi.page).to_have_title("Lupin twin")


def test_a_double_click_shelves_nothing_and_a_critical_alarm_needs_a_reason(
    domain: int, open_page: OpenPage
) -> None:
    with bridge(domain=domain) as running:
        two = [*[warm("a", 43.5, at=(1, 1))] * 2, *[warm("b", 27.0, at=(2, 1))] * 2]
        running.peer.observe(*two, *[warm("c", 27.0)] * 2, *[warm("c", 22.0)] * 2)
        hmi = open_page(running.url, viewport=PHONE)
        hmi.page.keyboard.press("a")
        expect(rows(hmi, "active")).to_have_count(2)
        times = hmi.page.locator(".shelf-times button")
        panel = hmi.page.locator(".disclosure-panel:not([hidden])")

        def tops() -> list[float]:
            return [place(row).top for row in rows(hmi, "active").all()]

        for tag, viewport in itertools.product(("b", "a"), (PHONE, WIDE)):
            hmi.page.keyboard.press("Escape")
            hmi.resize(**viewport)
            for row in rows(hmi, "active").all():
                expect(row).to_be_in_viewport(ratio=1)
                # Two lines; on a phone three, with the actions beside them (test_layout).
                assert height(row) <= (64 if viewport == WIDE else 96)
                if viewport == WIDE:
                    tools = row.locator(".alarm-tools button").all()
                    assert len({place(each).top for each in tools}) == 1
                    assert apart(row.locator(".alarm-tools"), row.locator(".alarm-go"))
            button = hmi.page.get_by_role("button", name=f"Actions: Tag {tag}")
            before = tops()
            button.dblclick()
            panel.get_by_role("button", name="Shelve").dblclick()
            expect(times.first).to_be_visible()
            # In a list that need not scroll, no row moves.
            assert viewport == PHONE or tops() == before
            expect(panel).to_be_in_viewport(ratio=1)
            assert apart(button, panel)
            # Nor does the heading of the next section cover it.
            panel.get_by_role("textbox").click()
            expect(hmi.page.get_by_role("button", name="Unshelve")).to_have_count(0)
        # A small screen has no more lines, whatever the value.
        running.peer.observe(warm("b", 26.03))
        expect_few_lines(hmi, "now just above 26.0")
        # The critical one.
        expect(times).to_have_text(["For 15 min", "For 1 h"])
        for each in times.all():
            expect(each).to_be_disabled()
        hmi.page.get_by_label("Reason").fill("fan is being mended")
        # The second click of two, where the panel was, hits nothing.
        times.last.dblclick()
        leave(hmi)
        shelved = rows(hmi, "shelved")
        expect(shelved).to_contain_text(re.compile(r"shelved until [\d:]+: fan is being mended"))
        expect(hmi.page).to_have_title("(1) Lupin twin")
        hmi.page.get_by_role("button", name="Undo").click()
        expect(shelved).to_have_count(0)
        expect(rows(hmi, "active")).to_have_count(2)
        # One that is not critical: for longer, and without a reason. It can be withdrawn later.
        act(hmi, "b", "Shelve")
        times.get_by_text("For 8 h").click()
        hmi.page.reload()
        hmi.page.keyboard.press("a")
        expect(shelved).to_contain_text("shelved until")
        act(hmi, "b", "Unshelve")
        leave(hmi)
        expect(rows(hmi, "active")).to_have_count(2)


def height(row: Locator) -> float:
    return place(row).bottom - place(row).top


def expect_few_lines(hmi: Hmi, value: str) -> None:
    expect(fact(rows(hmi, "active").filter(has_text="Tag b"), "now")).to_contain_text(value)
    hmi.resize(1024, 768)
    assert all(height(row) <= 64 for row in rows(hmi, "active").all())
    hmi.resize(**WIDE)


def apart(one: Locator, other: Locator) -> bool:
    """Whether no point of the screen is within both."""
    a, b = one.bounding_box(), other.bounding_box()
    assert a is not None
    assert b is not None
    return (
        a["x"] + a["width"] <= b["x"]
        or b["x"] + b["width"] <= a["x"]
        or a["y"] + a["height"] <= b["y"]
        or b["y"] + b["height"] <= a["y"]
    )


def test_a_row_leads_to_its_tag_as_it_is_now_and_a_button_to_its_start(
    domain: int, open_page: OpenPage
) -> None:
    with bridge(domain=domain) as running:
        robot = running.peer
        robot.observe(*[warm("a", value, at=(1, 1)) for value in (41.0, 43.5)])
        [alarm] = active(running, 1)
        raised_s = alarm["raised_at"]["sec"] + alarm["raised_at"]["nanosec"] / 1e9
        wait_for(lambda: time.time() > raised_s + 1, "a second after the alarm")
        robot.observe(warm("a", 42.0))
        running.tag("a", lambda tag: 42.0 in [each["value"] for each in tag["readings"]])
        hmi = open_page(running.url)
        hmi.page.keyboard.press("a")
        row = rows(hmi, "active")
        hmi.tab_to(row.get_by_role("button", name="Actions: Tag a"))
        hmi.page.keyboard.press("Enter")
        hmi.tab_to(row.get_by_role("button", name="Go to start"))
        hmi.page.keyboard.press("Enter")
        shown = re.compile(rf"^{int(raised_s)}\.\d+$|^{int(raised_s)}$")
        expect(hmi.app).to_have_attribute("data-moment", shown)
        expect(hmi.card("a")).to_contain_text("43.5")
        expect(hmi.test_id("card-chart")).to_have_attribute("data-state", "ready")
        hmi.resize(**WIDE)
        room = hmi.page.locator(".alarms")
        hmi.expect(lambda: place(room).bottom > place(room).top + 200, "alarms above the card")
        # The list is still the current one.
        expect(fact(row, "now")).to_contain_text("now 42.0")
        hmi.page.locator(".alarm-go").click()
        expect(hmi.app).to_have_attribute("data-moment", "now")
        # A new one while somebody looks back: nothing gives way to it.
        hmi.turn(f"list=alarms&at={int(raised_s) + 1}")
        expect(rows(hmi, "active")).to_have_count(1)
        expect(hmi.page.locator(".health")).to_contain_text("43.5")  # as it was then
        before = places(hmi, ".map-frame", ".alarms")
        robot.observe(*[warm("b", 43.5, at=(2, 1))] * 2)
        news = hmi.test_id("meanwhile").locator("visible=true")
        expect(news).to_contain_text("New alarm: Tag b")
        assert places(hmi, ".map-frame", ".alarms") == before
        # On a phone, it lies over the end of the card, which can be scrolled clear of it.
        hmi.resize(**PHONE)
        hmi.page.locator(".pane-tabs button").last.click()
        hmi.turn(f"list=alarms&tag=a&at={int(raised_s) + 1}")
        expect(hmi.app).to_have_attribute("data-pane", "tags")
        content = hmi.card("a").locator(".card-body")

        def is_clear() -> bool:
            content.evaluate("it => it.scrollTo(0, it.scrollHeight)")
            return apart(content.locator("> *").last, news)

        hmi.expect(is_clear, "the card's end clear of the message")
        assert news.get_by_role("button", name="Back to live").evaluate(LINES) == 1
        news.get_by_role("button", name="Back to live, show tag b").click()
        expect(hmi.card("b")).to_be_visible()


def test_nothing_moves_while_a_finger_rests_on_the_list(domain: int, open_page: OpenPage) -> None:
    """`AlarmPanel.test.tsx` has the same for the mouse."""
    with bridge(domain=domain) as running:
        robot = running.peer
        robot.observe(*[warm(tag, 27.0, at=(1, 1)) for tag in ("a", "b") * 2])
        hmi = open_page(running.url, has_touch=True)
        hmi.page.keyboard.press("a")
        expect(rows(hmi, "active")).to_have_count(2)
        order = where(hmi)
        button = rows(hmi, "active").last.get_by_role("button", name="Acknowledge")
        box = button.bounding_box()
        assert box is not None
        with resting(hmi, box["x"] + 9, box["y"] + 9):
            # Worse than both, so it would come before them; one of them is resolved.
            robot.observe(*[warm("c", 43.5, at=(2, 1))] * 2, *[warm(order[0], 22.0)] * 2)
            expect(hmi.page).to_have_title("(2) Lupin twin")
            expect(hmi.test_id("alarm-line")).to_have_text("1 new")
            expect(rows(hmi, "active").first).to_contain_text("resolved")
            assert where(hmi) == order
            assert button.bounding_box() == box

        expect(rows(hmi, "active").first).to_have_attribute("data-where", "c")
        expect(hmi.test_id("alarm-line")).to_have_text("")
        assert where(hmi) == ["c", order[1]]
        open_resolved(hmi, 1)
        expect(rows(hmi, "resolved")).to_have_attribute("data-where", order[0])
        # Of many of one cause the heading has the worst values, and the rows follow a click.
        leave(hmi)
        robot.observe(*[warm(f"{at}", at + 3.0) for at in (40, 41, 42)] * 2)
        caused = hmi.page.locator("[data-caused=true] [data-alarm]")
        values = fact(hmi.page.locator("[data-group=active]"), "now")
        expect(values).to_have_count(1)
        expect(caused).to_have_count(0)
        hmi.page.locator("[data-group=active] .alarm-cause .alarm-go").click()
        expect(values).to_have_count(6)
        # Their values form one column, at 1024 px as well, where each row has two lines.
        for width in (1440, 1024):
            hmi.resize(width, 800)
            ends = {place(it.locator("> span").first).right for it in values.all()}
            assert len(ends) == 1, width
            assert all(place(row).bottom - place(row).top <= 64 for row in caused.all())
        # On a phone all are equally high, and no button covers a word.
        hmi.resize(360, 844)
        assert len({place(row).bottom - place(row).top for row in caused.all()}) == 1
        assert words_below(hmi, "[data-caused=true] .alarm-go", ".alarm-tools > *") == []
        assert out_of_reach(hmi, "[data-caused=true] button") == []
        # Old values ask for nothing, and no row grows or shrinks for it.
        heights = [place(row).bottom - place(row).top for row in caused.all()]
        todo = hmi.page.locator(".alarm-cause .alarm-do")
        expect(todo).to_be_visible()
        running.process.kill()
        hmi.allow_noise(SERVER_GONE)
        expect(values).to_have_text([re.compile("now unknown")] * 6)
        expect(todo).to_be_hidden()
        assert [place(row).bottom - place(row).top for row in caused.all()] == heights


def where(hmi: Hmi) -> list[str]:
    """The tags of the active alarms, from the top."""
    tags = rows(hmi, "active").evaluate_all("rows => rows.map(row => row.dataset.where)")
    assert isinstance(tags, list)
    return tags


@contextmanager
def resting(hmi: Hmi, x: float, y: float) -> Iterator[None]:
    """A finger rests on a point of the page, pixels; at the end it is lifted."""
    session = hmi.page.context.new_cdp_session(hmi.page)
    touch = "Input.dispatchTouchEvent"
    session.send(touch, {"type": "touchStart", "touchPoints": [{"x": x, "y": y}]})
    yield
    session.send(touch, {"type": "touchCancel", "touchPoints": []})
