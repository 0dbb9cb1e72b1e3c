"""Operation: sensors, table, layers, range, units; by mouse and by keyboard alone."""

import re
from urllib.parse import parse_qs, urlsplit

import pytest
from playwright.sync_api import expect

from tests.browser.hmi import PHONE, Hmi, OpenPage
from tests.browser.places import place, places
from tests.support.web import Bridge


def test_sensors_are_one_line_with_the_chosen_one_in_sight(hmi: Hmi) -> None:
    for size in ((844, 390), (1280, 600), (1024, 768)):
        hmi.resize(*size)
        hmi.choose_sensor("Dew margin")
        chosen, bar = places(hmi, ".sensors label:has(:checked)", ".sensor-picker")
        assert bar.bottom - bar.top < 60
        assert bar.left <= chosen.left < chosen.right <= bar.right


def test_the_row_of_sensors_fades_where_there_are_more(
    greenhouse: Bridge, open_page: OpenPage
) -> None:
    hmi = open_page(greenhouse.url, viewport=PHONE)
    row = hmi.page.locator(".sensor-picker")
    expect(row).to_have_attribute("data-more", "after")
    expect(row).to_have_css("mask-image", re.compile("gradient"))
    hmi.choose_sensor("Dew margin")
    expect(row).to_have_attribute("data-more", "before")
    # In a wider window, all of them are in sight.
    for width in (700, 1440, 3840):
        hmi.resize(width, 900)
        expect(row).to_have_attribute("data-more", "")
        expect(row).to_have_css("mask-image", "none")
        last, bar = places(hmi, ".sensors label:last-child", ".sensor-picker")
        assert bar.left < last.left < last.right <= bar.right
        assert last.bottom <= bar.bottom


def test_a_sensor_has_its_colours_texts_legend_and_column(hmi: Hmi) -> None:
    expect(hmi.test_id("ideal-scale")).to_contain_text("daytime ideal 18.0 to 26.0 °C")
    for at, words in (((1.3, 1.3), "ideal"), ((1.3, 3.3), "too high by 5.0\u00a0°C")):
        hmi.point_at(*at)
        expect(hmi.test_id("readout-ideal")).to_have_text(words)
    # Too high is orange, the ideal range is green.
    hmi.expect_pixels(lambda pixel: pixel[0] > pixel[2] + 60, (1.4, 3.3), what="orange")
    hmi.expect_pixels(lambda pixel: pixel[1] > pixel[0] + 15, (1.4, 1.5), what="green")
    hmi.colour_by_value()
    hmi.point_at(1.3, 3.3)
    expect(hmi.test_id("readout")).to_contain_text("too high by")
    hmi.expect(lambda: "colour=value" in hmi.address(), "an address of that colouring")

    legend, chosen = hmi.test_id("legend"), hmi.page.locator("thead th.chosen")
    expect(legend).to_contain_text("Temperature °C")
    expect(chosen).to_have_attribute("data-column", "temperature")
    expect(hmi.test_id("range-low")).to_have_text("18.0")
    expect(hmi.test_id("range-high")).to_have_text("31.0\u00a0°C")
    before = hmi.settled_picture()

    hmi.choose_sensor("Humidity")
    expect(legend).to_contain_text("Humidity %")
    expect(chosen).to_have_attribute("data-column", "humidity")
    expect(hmi.test_id("range-low")).to_have_text("40.0")
    expect(hmi.test_id("range-high")).to_have_text("85.0\u00a0%")
    hmi.expect_change(before)
    # At the most humid tag: a clear blue where temperature's red was not.
    hmi.expect_pixels(lambda pixel: pixel[2] > pixel[0] + 50, (3.3, 3.3), what="a clear blue")

    hmi.choose_sensor("Vapour pressure deficit")
    expect(chosen).to_have_attribute("data-column", "vpd")
    expect(hmi.cell("1", "vpd")).to_have_text("0.94")

    hmi.choose_sensor("Soil moisture")
    hmi.expect_samples(1)
    hmi.choose_sensor("Light")  # its only tag has no pose
    expect(hmi.test_id("sample-count")).to_have_text("No tag contributes")
    expect(hmi.test_id("notice")).to_have_attribute("data-notice", "no-reading")


def test_beside_a_card_the_table_has_rows_and_the_chosen_one_is_not_below_its_head(
    hmi: Hmi,
) -> None:
    hmi.resize(1280, 720)
    hmi.row("3").click()
    hmi.expect_parts()
    expect(hmi.card("3")).to_be_visible()
    frame = hmi.page.locator(".table-scroll")
    head, table = place(hmi.page.locator("thead")), place(frame)
    assert (table.bottom - head.bottom) / 45 > 3.7
    assert place(hmi.card("3")).bottom == 720
    # Its place after the table is sorted anew: half of it below the head.
    hmi.page.locator("th[data-column=tag] button").hover()
    frame.evaluate("(frame) => { frame.scrollTop = 112; }")
    hmi.page.mouse.down()
    hmi.page.mouse.up()
    hmi.expect_rows("1", "2", "3", "9", "10", "failed", "seen")
    hmi.expect(lambda: place(hmi.row("3")).top == head.bottom, "the chosen row below the head")


def test_a_row_and_its_pin_mark_each_other_and_the_card_shows_everything(hmi: Hmi) -> None:
    hmi.click_map(3, 1)
    expect(hmi.card("2")).to_be_visible()
    expect(hmi.row("2")).to_have_attribute("data-selected", "true")
    hmi.point_at(1, 1)
    expect(hmi.row("1")).to_have_attribute("data-hovered", "true")
    # Its short card is never in the way.
    expect(hmi.test_id("hover-card")).to_have_css("pointer-events", "none")

    hmi.page.get_by_role("button", name="Close").first.click()
    # The button lay above a row, under the mouse now: move it off, or the pin is marked already.
    hmi.page.get_by_role("searchbox").hover()
    expect(hmi.page.locator("tr[data-hovered=true]")).to_have_count(0)
    before = hmi.settled_picture()
    hmi.row("10").hover()
    mark = hmi.lasting_change(before)
    x, y = hmi.view().pixel(1, 3)
    assert abs((mark.left + mark.right - 1) / 2 - x) <= 1.5
    assert abs((mark.top + mark.bottom - 1) / 2 - y) <= 1.5

    hmi.click_map(1, 3)
    card = hmi.card("10")
    expect(card).to_contain_text("3 pests seen")
    expect(card.locator("[data-sensor=temperature]")).to_contain_text("31.0\u00a0°C")
    expect(card.locator("[data-sensor=temperature]")).to_contain_text("high, daytime ideal")
    expect(card).to_contain_text("Lupin")
    expect(card).to_contain_text("x 1.00 m, y 3.00 m")


def _on_page(hmi: Hmi, x: float, y: float) -> tuple[float, float]:
    box = hmi.map.bounding_box()
    assert box is not None
    return box["x"] + x, box["y"] + y


def test_the_readout_shows_what_is_known_and_the_map_zooms_about_the_pointer(hmi: Hmi) -> None:
    hmi.point_at(1.02, 2.98)
    expect(hmi.test_id("readout")).to_have_text(
        re.compile(r"^31\.0\s°C\s?too high by 5\.0\s°Cx 1\.0\d m, y (2|3)\.\d\d m$")
    )
    hmi.point_at(0.1, 5.9)
    expect(hmi.test_id("readout")).to_contain_text("unknown")

    start = hmi.view()
    x, y = start.pixel(1, 1)
    hmi.map.hover(position={"x": x, "y": y})
    hmi.page.mouse.wheel(0, -240)
    hmi.expect(lambda: hmi.view().scale > start.scale * 1.2, "a closer view")
    # The point under the pointer stays there.
    assert hmi.view().pixel(1, 1) == pytest.approx((x, y), abs=1)

    zoomed = hmi.view()
    hmi.page.mouse.down()
    hmi.page.mouse.move(*_on_page(hmi, x + 60, y - 40), steps=4)
    hmi.page.mouse.up()

    def has_moved() -> bool:
        moved = hmi.view()
        return (moved.x - zoomed.x, moved.y - zoomed.y) == pytest.approx((60, -40), abs=1)

    hmi.expect(has_moved, "the map that follows the mouse")

    hmi.page.get_by_role("button", name="Fit to view").click()
    hmi.expect(lambda: hmi.view() == start, "the view of everything")
    hmi.page.get_by_role("button", name="Zoom in").click()
    hmi.expect(lambda: hmi.view().scale > start.scale * 1.4, "a closer view")


def test_each_layer_can_be_hidden_and_shown(hmi: Hmi) -> None:
    # At some scales Chromium rounds a few pixels of an image differently when it paints it again.
    hmi.resize(1440, 824)
    hmi.page.get_by_role("button", name="Layers").click()
    panel = hmi.page.locator(".layers .disclosure-panel")
    # The part of the map outside the panel, which changes with each click.
    left = round(_on_page(hmi, 0, 0)[0])
    free = panel.bounding_box()
    assert free is not None
    width = round(free["x"]) - left - 20
    with_it = hmi.settled_picture(width)
    for box in panel.get_by_role("checkbox").all():
        box.click()
        hmi.expect_change(with_it)
        box.click()
        hmi.expect_picture(with_it)
    assert panel.get_by_role("checkbox").count() == 9


def test_sensor_layers_zoom_table_and_tag_by_keyboard_alone(hmi: Hmi) -> None:
    keyboard = hmi.page.keyboard

    hmi.tab_to(hmi.page.locator(".sensors input:checked"))
    keyboard.press("ArrowRight")
    expect(hmi.test_id("legend")).to_contain_text("Humidity %")

    hmi.tab_to(hmi.map)
    before = hmi.view()
    keyboard.press("+")
    hmi.expect(lambda: hmi.view().scale > before.scale, "a closer view")
    zoomed, width = hmi.view(), hmi.picture().width
    keyboard.press("ArrowLeft")
    tenth = pytest.approx(zoomed.x + 0.1 * width, abs=1)
    hmi.expect(lambda: hmi.view().x == tenth, "what was left of the view")
    expect(hmi.test_id("readout")).to_be_visible()  # of the crosshair
    keyboard.press("0")
    hmi.expect(lambda: hmi.view() == before, "the view of everything")

    hmi.tab_to(hmi.page.get_by_role("button", name="Zoom in"))
    keyboard.press("Enter")
    hmi.expect(lambda: hmi.view().scale > before.scale, "a closer view")

    hmi.tab_to(hmi.page.get_by_role("button", name="Layers"))
    keyboard.press("Space")
    pins = hmi.page.get_by_role("checkbox", name="Tag pins")
    hmi.tab_to(pins)
    keyboard.press("Space")
    expect(pins).not_to_be_checked()
    keyboard.press("Escape")
    expect(pins).to_have_count(0)
    expect(hmi.page.get_by_role("button", name="Layers")).to_be_focused()

    header = hmi.page.locator("th[data-column=humidity]")
    hmi.tab_to(header.get_by_role("button"))
    keyboard.press("Enter")
    expect(header).to_have_attribute("aria-sort", "ascending")

    hmi.tab_to(hmi.row("3").get_by_role("button"))
    keyboard.press("Enter")
    expect(hmi.card("3")).to_be_visible()
    keyboard.press("Escape")
    expect(hmi.card("3")).to_have_count(0)


def test_every_focus_is_visible_and_none_is_a_trap(hmi: Hmi) -> None:
    seen: list[str] = []
    for _ in range(120):
        hmi.page.keyboard.press("Tab")
        name, ring, bare = hmi.page.evaluate(
            """() => {
              const element = document.activeElement;
              const whole = element.closest('label') ?? element;
              const look = () => [whole, ...whole.querySelectorAll('*')]
                .map(getComputedStyle)
                .map((style) => [style.outline, style.boxShadow, style.borderColor, style.top])
                .join();
              const ring = look();
              element.blur();
              const bare = look();
              element.focus();
              return [`${element.tagName} ${element.ariaLabel ?? whole.textContent}`, ring, bare];
            }"""
        )
        if name.startswith("BODY"):
            break
        assert ring != bare, f"the focus is not to be seen on {name}"
        seen.append(name)
    else:
        raise AssertionError(f"120 times Tab did not lead through the page: {seen[-5:]}")
    assert len(seen) > 25


def test_help_takes_the_focus_and_no_key_reaches_through_it(hmi: Hmi) -> None:
    hmi.tab_to(hmi.map)
    hmi.page.keyboard.press("?")
    dialog = hmi.page.get_by_role("dialog")
    expect(dialog).to_be_visible()
    expect(dialog).to_contain_text("Choose a sensor")
    assert dialog.evaluate("dialog => dialog.contains(document.activeElement)")
    # No shortcut reaches through it.
    hmi.page.keyboard.press("2")
    hmi.page.keyboard.press("Escape")
    expect(dialog).to_have_count(0)
    expect(hmi.map).to_be_focused()
    expect(hmi.test_id("legend")).to_contain_text("Temperature")
    hmi.page.keyboard.press("/")
    expect(hmi.page.get_by_role("searchbox")).to_be_focused()


def test_the_page_uses_the_language_of_the_browser_or_the_address_or_the_menu(
    greenhouse: Bridge, open_page: OpenPage
) -> None:
    hmi = open_page(greenhouse.url, "sensor=humidity&tag=1", locale="de-AT")
    expect(hmi.test_id("legend")).to_contain_text("Luftfeuchte")
    expect(hmi.card("1")).to_contain_text("Messpunkt 1")
    # A page measures its columns once its font is there.
    hmi.expect(lambda: hmi.page.evaluate(_BROKEN) == [], "whole words in the heads")
    hmi.page.locator(".menu > button").click()
    hmi.test_id("language").select_option(label="Nederlands")
    expect(hmi.test_id("legend")).to_contain_text("Luchtvochtigheid (RV)")
    expect(hmi.card("1")).to_contain_text("Meetpunt 1")
    hmi.expect(lambda: hmi.page.evaluate(_BROKEN) == [], "whole words in the heads")
    stored = {"sensor": ["humidity"], "tag": ["1"]}
    hmi.expect(
        lambda: (
            urlsplit(hmi.address()).query == "lang=nl"
            and stored.items() <= parse_qs(urlsplit(hmi.address()).fragment).items()
        ),
        "the language in the address, beside the view",
    )

    # In place of a language that is missing, one that its user may know.
    hmi.go(query="?lang=xx")
    expect(hmi.page.locator("html")).to_have_attribute("lang", "en")


# The words of the table's heads that wrap.
_BROKEN = """() => [...document.querySelectorAll('thead button span:not(.unseen, .head-unit)')]
  .filter((head) => head.checkVisibility())
  .flatMap((head) => [...head.childNodes].filter((node) => node.nodeType === 3))
  .flatMap((node) => [...node.data.matchAll(/\\S+/g)].filter(({ 0: word, index }) => {
    const range = document.createRange();
    range.setStart(node, index);
    range.setEnd(node, index + word.length);
    return range.getClientRects().length > 1;
  }).map(([word]) => word))"""


# Two heads that are closer than the words of one; and those that are cut.
_HEADS_TOO_CLOSE = """() => {
  const rectsOf = (head) => {
    const range = document.createRange();
    const words = document.createTreeWalker(head.firstChild, NodeFilter.SHOW_TEXT);
    const found = [];
    while (words.nextNode()) {
      if (words.currentNode.parentElement.closest('.unseen')) continue;
      range.selectNode(words.currentNode);
      found.push(...range.getClientRects());
    }
    return found;
  };
  const boxes = [...document.querySelectorAll('thead button')]
    .filter((head) => head.checkVisibility())
    .map((head) => [head, rectsOf(head)]);
  const cut = boxes.filter(([head]) => head.scrollHeight > head.clientHeight + 1);
  const close = boxes.filter(([, rects], at) => at > 0 && Math.min(...rects.map((r) => r.left))
    < Math.max(...boxes[at - 1][1].map((r) => r.right)) + 8);
  return [...cut, ...close].map(([head]) => head.textContent);
}"""


@pytest.mark.parametrize("has_font", [True, False])
def test_in_each_language_heads_stay_apart_and_whole_and_the_chosen_sensor_moves_no_age(
    greenhouse: Bridge, open_page: OpenPage, has_font: bool
) -> None:
    hmi = open_page(greenhouse.url, go=False)
    if not has_font:
        hmi.page.route("**/*.woff2", lambda route: route.abort())
        hmi.allow_noise(r"woff2|ERR_FAILED")
    for language in ("en", "de", "nl", "es"):
        hmi.go(query=f"?lang={language}")
        hmi.resize(360, 1024)
        hmi.page.locator(".pane-tabs button").nth(1).click()
        for width in (360, 768, 1440, 1100, 1280):
            hmi.resize(width, 800)
            expect(hmi.row("1")).to_be_visible()
            assert hmi.page.evaluate(_BROKEN) == [], (language, width)
            if width < 1100:
                continue
            assert hmi.page.evaluate(_HEADS_TOO_CLOSE) == [], (language, width)
            sensors, head = places(hmi, ".sensor-picker", "thead")
            assert width == 1100 or sensors.bottom - sensors.top < 60, (language, width)
            assert head.bottom - head.top < 50, (language, width)
        age = hmi.page.locator("thead [data-column=age]")
        before = place(age).left
        hmi.page.keyboard.press("2")
        expect(hmi.page.locator("thead .chosen")).to_have_attribute("data-column", "humidity")
        assert place(age).left == pytest.approx(before, abs=0.5)
        hmi.page.keyboard.press("a")
        alarm = place(hmi.page.locator("[data-group=active] [data-alarm]").first)
        assert alarm.bottom - alarm.top < 64, language
