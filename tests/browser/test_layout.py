"""All window sizes and vision settings: everything is there, in its place, and can be clicked."""

import re
from collections.abc import Callable, Iterator
from functools import partial

import pytest
from playwright.sync_api import expect

from tests.browser.greenhouse import TAGS
from tests.browser.hmi import PHONE, Box, Hmi, OpenPage
from tests.browser.places import LINES, expect_in_reach, place, places, words_below
from tests.support.messages import scan
from tests.support.web import Bridge, bridge

Size = tuple[int, int]

# A laptop of 1440 × 900 zoomed to 200 %; a phone on its side.
ZOOMED, LANDSCAPE = (720, 450), (740, 360)
LOW = (ZOOMED, LANDSCAPE, (1280, 540))
# A tablet on its side, below a browser's bars; half a screen, and a little less.
MIDDLING = ((1024, 650), (960, 896), (960, 895), (1100, 800))
SIZES = ((360, 640), (820, 1180), (1440, 900), *LOW)
# A phone, a laptop, and a phone on its side: one of each layout.
FEW = ((360, 640), (1440, 900), LANDSCAPE)
# Tablets held upright, and other narrow windows: map or table, and the card below the map.
UPRIGHT = ((768, 1024), (820, 1180), (960, 896), (1020, 1100))
# A wall screen without its own scale: slow to draw.
HUGE = (3840, 2160)

CONTROLS = "button, a[href]:not(.skip), input, .legend li, .legend-title, .legend-facts span"


@pytest.fixture
def open_at(greenhouse: Bridge, open_page: OpenPage) -> Callable[..., Hmi]:
    """`open_at(size, fragment, query, **options)`: the greenhouse in a window of that size."""

    def open_one(size: Size, fragment: str = "", query: str = "", **options: object) -> Hmi:
        viewport = {"width": size[0], "height": size[1]}
        hmi = open_page(greenhouse.url, fragment, query, viewport=viewport, **options)
        hmi.expect_samples()
        hmi.settled_picture()
        return hmi

    return open_one


# Created before `open_page`, so that it ends after the pages.
@pytest.fixture
def running(domain: int) -> Iterator[Bridge]:
    """A server with a greenhouse that is empty at first."""
    with bridge(domain=domain) as empty:
        yield empty


def show(hmi: Hmi, name: str) -> None:
    """Go to the map or to the table (Tags), where the window shows one of the two."""
    expect(hmi.row("1")).to_be_attached()
    tabs = hmi.page.locator(".pane-tabs")
    if tabs.is_visible():
        tabs.get_by_role("button", name=name).click()
    expect(hmi.map if name == "Map" else hmi.row("1")).to_be_visible()


# How much of a table is out of sight to the right, px.
HIDDEN = "table => table.scrollWidth - table.clientWidth"


def test_everything_can_be_clicked(open_at: Callable[..., Hmi]) -> None:
    hmi = open_at(SIZES[0])
    for size in (*SIZES, *MIDDLING, HUGE):
        hmi.resize(*size)
        show(hmi, "Map")
        has_tabs = hmi.page.locator(".pane-tabs").is_visible()
        expect(hmi.test_id("health-strip")).to_be_visible(visible=has_tabs)
        for mode in ("Ideal", "Value"):
            hmi.open_details()
            hmi.page.get_by_role("radio", name=mode).check()
            hmi.open_details(False)
            # Lower than this, a greenhouse of ten metres is the size of a stamp. A phone on its
            # side gives it all of the height.
            least = 300 if size == LANDSCAPE else 120 if size in LOW else 200
            tall = "([map, least]) => map.clientHeight >= least"
            hmi.page.wait_for_function(tall, arg=[hmi.map.element_handle(), least])
            expect_in_reach(hmi, CONTROLS)
        # A greenhouse beside them has the height of a phone on its side.
        controls = place(hmi.page.locator(".map-controls"))
        assert size != LANDSCAPE or controls.right - controls.left < 50
        hmi.page.get_by_role("button", name="Layers").click()
        expect(hmi.page.locator(".layers .check")).to_have_count(9)
        expect_in_reach(hmi, ".layers .check")
        scrolls = "e => e.scrollHeight > e.clientHeight"
        assert size != LANDSCAPE or not hmi.page.locator(".layers > div").evaluate(scrolls)
        hmi.page.keyboard.press("Escape")
        show(hmi, "Tags")
        expect_in_reach(hmi, "tbody tr, .filter-bar *:not(.unseen), .health button")
        assert hmi.page.locator(".table-scroll").evaluate(HIDDEN) == 0, size
        # In a narrower window, the reason of a tag has the room.
        sure = hmi.row("1").locator(".cell-species .faint")
        has_room = 820 <= size[0] < 1024 or size[0] >= 1264
        expect(sure).to_be_visible(visible=has_room)
        if has_room:
            assert place(sure).right <= place(hmi.page.locator(".table-scroll")).right
        # Below its tag instead, but for a phone.
        species = hmi.row("1").get_by_text("Lupin").locator("visible=true")
        expect(species).to_have_count(0 if size == SIZES[0] else 1)
        head = hmi.page.locator("thead th").first.get_by_text("Tag")
        assert place(head).left == place(hmi.row("1").locator("bdi").first).left, size


def test_below_the_layers_their_labelled_choices_are_always_in_sight(
    open_at: Callable[..., Hmi],
) -> None:
    for size in ((1100, 800), (390, 844)):
        hmi = open_at(size)
        hmi.open_details()
        hmi.page.get_by_role("button", name="Layers").click()
        # Nothing of the details shows below it.
        expect(hmi.page.locator(".legend-more .legend-facts")).to_be_hidden()
        expect(hmi.page.locator(".layers .check")).to_have_count(9)
        choice = hmi.test_id("compare")
        expect(choice).to_be_in_viewport(ratio=1)
        choice.select_option("day")
        expect(hmi.test_id("legend")).to_contain_text("difference")
        expect(choice).to_be_in_viewport(ratio=1)
    expect(hmi.page.locator(".layers").get_by_text("Heat map shows")).to_be_visible()
    heat = place(hmi.test_id("heat"))
    assert heat.top >= place(hmi.page.locator(".layer-list")).bottom


def test_the_label_of_now_has_one_line_of_the_time_bar(
    greenhouse: Bridge, open_page: OpenPage
) -> None:
    hmi = open_page(greenhouse.url, query="?lang=es", viewport={"width": 1100, "height": 800})
    now = hmi.test_id("timebar-when")
    expect(now).to_have_text("En directo")
    hmi.expect_layout()
    assert place(now).bottom - place(now).top < 24
    # A moment of the past takes two, beside the choices.
    hmi.go("at=1795970265", "?lang=de")
    expect(now).to_contain_text("Nov.")
    hmi.expect_parts()
    hmi.view()
    assert words_below(hmi, ".timebar-when", ".timebar-period") == []


def test_the_legend_is_one_line_and_its_details_open_over_the_map(
    greenhouse: Bridge, open_page: OpenPage
) -> None:
    for language, width in (*((each, 1100) for each in LANGUAGES), ("de", 1440)):
        viewport = {"width": width, "height": 900}
        hmi = open_page(greenhouse.url, query=f"?lang={language}", viewport=viewport)
        hmi.expect_layout()
        scale = place(hmi.test_id("ideal-scale"))
        assert scale.bottom - scale.top < 36, f"{language}: one line below the colours"
        for line in (
            (".legend-title", ".legend summary"),
            (".sensors label", ".sensors :last-child"),
        ):
            first, last = places(hmi, *line)
            assert first.top < last.bottom, (language, width)
            assert last.top < first.bottom, (language, width)
        hmi.open_details()
        assert place(hmi.page.locator(".legend-more .legend-facts")).bottom <= scale.top


def test_an_upright_window_has_the_map_or_the_table_and_a_card_below_the_map(
    open_at: Callable[..., Hmi],
) -> None:
    hmi = open_at(UPRIGHT[0])
    for width, height in UPRIGHT:
        hmi.resize(width, height)
        show(hmi, "Map")
        frame = place(hmi.page.locator(".map-frame"))
        assert frame.bottom - frame.top > height / 2, (width, height)
        show(hmi, "Tags")
        expect(hmi.map).to_be_hidden()
        expect(hmi.row("10")).to_be_in_viewport(ratio=1)
    show(hmi, "Map")
    hmi.turn("tag=1")
    expect(hmi.card("1")).to_be_visible()
    for width, height in UPRIGHT:
        hmi.resize(width, height)
        expect_in_reach(hmi, ".map-controls button, .card button, .pane-tabs button")
        frame, card, tabs = places(hmi, ".map-frame", ".card", ".pane-tabs")
        assert frame.top + 200 <= frame.bottom <= card.top < card.bottom <= tabs.top


def test_a_small_laptop_has_status_map_and_table_at_first_glance(
    open_at: Callable[..., Hmi],
) -> None:
    hmi = open_at((1024, 768))
    status, map_, table = places(hmi, ".health", ".map-frame", ".list")
    assert map_.right < status.left == table.left
    assert status.bottom == table.top
    assert map_.bottom - map_.top > 400
    for tag_id in TAGS:
        expect(hmi.row(tag_id)).to_be_in_viewport(ratio=1)
    hmi.go("", "?lang=es")
    hmi.page.locator("input[value=alarms]").check(force=True)
    bar = hmi.page.locator(".alarm-bar")
    expect(bar).to_be_visible()
    hmi.expect(lambda: bar.evaluate("e => e.clientHeight") < 70, "one line of controls")


def test_a_phone_has_room_for_the_facts_and_missing_data(
    open_at: Callable[..., Hmi],
) -> None:
    hmi = open_at((PHONE["width"], PHONE["height"]))
    legend = hmi.test_id("legend")
    facts = legend.locator(".legend-facts")
    expect(facts).to_be_hidden()
    legend.get_by_text("Details").click()
    expect(facts).to_contain_text("3 tags contribute")
    expect(facts.get_by_text("no data", exact=False).locator("visible=true")).to_have_count(1)
    # Over the map, whose height stays.
    assert place(facts).bottom <= place(legend).top
    hmi.turn("sensor=soil_moisture&colour=value")
    hmi.turn("sensor=radiation")
    expect(hmi.test_id("notice")).to_have_attribute("data-notice", "no-reading")
    notice, frame = places(hmi, "[data-testid=notice]", "[data-testid=map]")
    assert notice.bottom == pytest.approx(frame.bottom, abs=1)
    assert notice.top > frame.bottom - (frame.bottom - frame.top) / 3


def test_a_longer_message_about_the_greenhouse_does_not_move_the_table(
    running: Bridge, open_page: OpenPage
) -> None:
    running.peer.observe(scan("1", {"temperature": 22.0}, at=(1, 1)))
    hmi = open_page(running.url)
    driver = hmi.test_id("health-driver")
    expect(driver).to_have_text("All assessed readings are within their ideal ranges")
    # Late messages take room from the table, and so does one about a late server.
    hmi.expect_parts()
    hmi.expect_phase("live")
    hmi.page.evaluate("document.fonts.ready")
    before = {}
    for size in FEW:
        hmi.resize(*size)
        show(hmi, "Tags")
        before[size] = places(hmi, ".filter-bar")
    long = "a-tag-with-no-short-name"
    running.peer.observe(scan(long, {"temperature": 79.0}, at=(2, 1)))
    expect(driver).to_contain_text(long)
    for size in FEW:
        hmi.resize(*size)
        hmi.expect_phase("live")
        # A single task has the room of two, in larger text.
        if size == (1440, 900):
            expect(driver).to_have_css("font-size", "18px")
        in_place = partial(stands_at, hmi, before[size])
        hmi.expect(in_place, f"the table in its place at {size}")
    # The rest appears on hover, and a screen reader reads all of it.
    expect(driver).to_have_attribute("title", f"Tag {long}: Temperature 79.0\u00a0°C, above 35.0")


def test_the_table_stays_in_place_while_tags_arrive(running: Bridge, open_page: OpenPage) -> None:
    hmi = open_page(running.url)
    table = hmi.page.locator(".table-scroll")
    # Each sorts above the present ones, as the robot meets them in no order.
    for first in range(60, 0, -20):
        ids = [str(first + i) for i in range(20)]
        running.peer.observe(*(scan(i, {"temperature": 20.0}, at=(1, 1)) for i in ids))
        expect(hmi.row(ids[-1])).to_be_attached()
        assert table.evaluate("table => table.scrollTop") == 0
    expect(hmi.row("20")).to_be_in_viewport()


def stands_at(hmi: Hmi, filter_bar: list[Box]) -> bool:
    return places(hmi, ".filter-bar") == filter_bar


def test_an_empty_greenhouse_says_what_to_do_beside_the_controls_and_in_the_table(
    running: Bridge, open_page: OpenPage
) -> None:
    hmi = open_page(running.url)
    expect(hmi.test_id("notice")).to_have_attribute("data-notice", "no-tags")
    hmi.expect_parts()
    tabs = hmi.page.locator(".pane-tabs")
    for size in FEW:
        hmi.resize(*size)
        expect_in_reach(hmi, ".map-controls button")
        hmi.test_id("notice").locator("summary").click()
        expect(hmi.test_id("notice").locator("details")).to_have_attribute("open", "")
        hmi.test_id("notice").locator("summary").click()
        notice, controls, frame = places(
            hmi, "[data-testid=notice]", ".map-controls", "[data-testid=map]"
        )
        assert notice.right <= controls.left or notice.top >= controls.bottom, size
        assert frame.top <= notice.top
        assert notice.bottom <= frame.bottom
        if tabs.is_visible():
            tabs.get_by_role("button", name="Tags").click()
        expect(hmi.test_id("empty-table")).to_contain_text("start its patrol")
        if tabs.is_visible():
            tabs.get_by_role("button", name="Map").click()
    running.peer.observe(scan("1", {"temperature": 22.0}, at=(1, 1)))
    expect(hmi.row("1")).to_be_attached()
    expect(hmi.test_id("empty-table")).to_have_count(0)


def test_all_text_grows_with_the_browsers_text_size(open_at: Callable[..., Hmi]) -> None:
    hmi = open_at((1440, 900))
    # In one go, so that nothing arrives meanwhile.
    grow = """() => {
      const all = [...document.querySelectorAll('.app *:not(.unseen, .unseen *)')];
      const texts = () => all.map((e) => parseFloat(getComputedStyle(e).fontSize));
      document.documentElement.style.fontSize = '';
      const usual = texts();
      document.documentElement.style.fontSize = '200%';
      return [usual, texts()];
    }"""
    for size in ((1440, 900), (PHONE["width"], PHONE["height"])):
        hmi.resize(*size)
        usual, grown = hmi.page.evaluate(grow)
        assert grown == pytest.approx([2 * each for each in usual])
        expect_in_reach(hmi, CONTROLS)
        show(hmi, "Tags")
        expect_in_reach(hmi, ".row-button, .filter-bar *:not(.unseen), .health button")


def test_the_labels_of_the_ideal_range_are_below_its_bracket(open_at: Callable[..., Hmi]) -> None:
    hmi = open_at((1440, 900), "sensor=humidity&colour=value")
    expect(hmi.page.locator(".ramp-note")).to_be_visible()
    # Measured from the middle of the ramp, their position without a bracket.
    words, bracket, ramp = places(hmi, ".ramp-note", ".ramp-ideal", ".ramp-bar")
    aside = (bracket.left + bracket.right - ramp.left - ramp.right) / 2
    assert abs(aside) > 30
    assert (words.left + words.right - ramp.left - ramp.right) / 2 == pytest.approx(aside, abs=20)


def test_many_sensors_leave_the_reasons_their_room(running: Bridge, open_page: OpenPage) -> None:
    more = {f"leaf_temperature{number}": 1.0 for number in range(5)}
    running.peer.observe(scan("1", {"temperature": 45.0, "humidity": 60.0, **more}, at=(0, 0)))
    hmi = open_page(running.url)
    expect(hmi.cell("1", "leaf_temperature4")).to_be_attached()
    cell = hmi.row("1").locator(".cell-health")
    hmi.expect(lambda: cell.evaluate("e => e.clientWidth") > 130, "room for the reasons")
    # They have two lines: the status is its shape, and a word for screen readers.
    word = cell.locator(".health-mark > span")
    hmi.expect(lambda: word.evaluate("e => e.clientWidth") == 1, "no word")
    # Beside a narrow table's chosen sensor, too, which is in sight although the table is wider.
    hmi.resize(1024, 768)
    hmi.turn("sensor=leaf_temperature4")
    hmi.expect(lambda: cell.evaluate("e => e.clientWidth") > 120, "room for the reasons")
    running.peer.observe(scan("2", {"temperature": 45.0}, at=(1, 0)))
    why = hmi.row("2").locator(".why", has_text="Temperature")
    hmi.expect(lambda: why.evaluate(LINES) == 1, "a reason on one line")
    assert place(hmi.page.locator("thead .chosen")).right <= 1024
    assert hmi.page.locator(".table-scroll").evaluate(HIDDEN) > 0


# Elements beyond the window, or beyond their own box, that are no scrollable list. Of a column's
# head its words count; the arrow beside them may be hidden.
_TOO_LONG = """() => [...document.querySelectorAll('body *')].filter((e) => {
  if (!e.checkVisibility() || e.closest("canvas, .unseen, .skip")) return false;
  if (e.clientWidth <= 1) return false;
  const scrolls = (of) => of && (/auto|scroll/.test(getComputedStyle(of).overflowX)
    || scrolls(of.parentElement));
  const box = e.getBoundingClientRect();
  if (!scrolls(e) && (box.right > innerWidth + 1 || box.left < -1)) return true;
  const words = [...e.childNodes].find((node) => node.nodeType === 3);
  if (!words || getComputedStyle(e).textOverflow === 'ellipsis') return false;
  const range = document.createRange();
  range.selectNode(words);
  const end = range.getBoundingClientRect().right;
  return getComputedStyle(e).overflowX === "hidden" && end > box.right;
}).map((e) => `${e.tagName} ${e.className}: ${e.textContent}`)"""


# The table's reasons that are cut.
_CUT_REASONS = """() => [...document.querySelectorAll('tbody .cell-health > div')]
  .filter((e) => e.scrollHeight > e.clientHeight + 1).map((e) => e.textContent)"""

_COLOUR = "e => getComputedStyle(e).color"

# The parts of open actions that are left out.
_CUT_ACTIONS = """() => [...document.querySelectorAll('.health .do-what > *')]
  .filter((e) => e.offsetTop >= e.parentElement.offsetTop + e.parentElement.offsetHeight)
  .map((e) => e.textContent)"""

# A phone's texts in each language, and its format of a number.
LANGUAGES = {
    "en": ("tags contribute", "20.0"),
    "de": ("Messpunkte tragen bei", "20,0"),
    "nl": ("meetpunten tellen mee", "20,0"),
    "es": ("puntos aportan datos", "20,0"),
}


def test_every_language_has_room_on_a_phone(greenhouse: Bridge, open_page: OpenPage) -> None:
    hmi = open_page(greenhouse.url, go=False)
    for language, (contribute, reading) in LANGUAGES.items():
        hmi.resize(**PHONE)
        hmi.go(query=f"?lang={language}")
        expect(hmi.test_id("sample-count")).to_contain_text(contribute)
        expect(hmi.page.locator("html")).to_have_attribute("lang", language)
        hmi.expect_layout()
        assert hmi.page.evaluate(_TOO_LONG) == []
        # "Since" shares the last line of what to do first, or has no room.
        todo, since = places(hmi, ".health-strip .do-what strong", ".health-strip small")
        assert since.top < todo.bottom, language
        hmi.page.locator(".menu > button").click()
        expect(hmi.test_id("language")).to_have_value(language)
        assert hmi.page.evaluate(_TOO_LONG) == []
        hmi.page.keyboard.press("Escape")
        hmi.page.locator(".pane-tabs button").nth(2).click()
        tools = hmi.page.locator("[data-group=active] .alarm-tools").first
        expect(tools).to_be_visible()
        assert hmi.page.evaluate(_TOO_LONG) == []
        assert words_below(hmi, ".alarm-go", ".alarm-tools > *") == []
        row, *buttons = map(place, (tools.locator("xpath=.."), *tools.locator("button").all()))
        assert all(each.bottom - each.top >= 44 for each in buttons)
        assert row.bottom - row.top < 2.75 * 44, language
        hmi.page.locator(".pane-tabs button").nth(1).click()
        expect(hmi.cell("1", "temperature")).to_contain_text(reading)
        line = place(hmi.test_id("patrol-line"))
        assert line.bottom - line.top < 24, language
        assert hmi.page.evaluate(_TOO_LONG) == []
        # Three letters, and the arrow beside them: a word that cannot be broken.
        assert hmi.page.locator("thead th").first.locator("span").first.evaluate(LINES) == 1
        assert hmi.page.evaluate("document.documentElement.scrollWidth") == PHONE["width"]
        # On a phone and on the smallest laptops this column is narrow, with the arrow at first.
        for width in (PHONE["width"], 1100, 1280, 1440):
            hmi.resize(width, 800)
            assert hmi.page.evaluate(_CUT_REASONS) == [], (language, width)
            # A reason that has no room for its status's word has its colour.
            mark, why = (hmi.row("10").locator(e) for e in (".health-mark", ".why"))
            has_word = place(mark.locator("span")).right > place(mark.locator("svg")).right
            assert (mark.evaluate(_COLOUR) == why.evaluate(_COLOUR)) is not has_word, width
            if width >= 1100:
                assert hmi.page.evaluate(_CUT_ACTIONS) == [], (language, width)
            assert hmi.row("failed").locator(".row-button bdi").evaluate(LINES) == 1, width
            for head in hmi.page.locator("thead button > span:first-child:visible").all():
                words = place(head)
                assert words.bottom - words.top < 24, (language, width, head.inner_text())
        # Where the page's name has no room, none of it is shown.
        hmi.resize(230, 740)
        brand = place(hmi.page.locator(".brand"))
        assert place(hmi.page.locator(".brand > span")).top >= brand.bottom
        # While looking back, the last tab says more.
        hmi.resize(**PHONE)
        hmi.go("at=1795970265", f"?lang={language}")
        count = hmi.page.locator(".pane-tabs").get_by_test_id("alarm-count")
        expect(count).to_contain_text(re.compile("[a-z]"))
        assert place(count).right <= PHONE["width"] - 8, language
