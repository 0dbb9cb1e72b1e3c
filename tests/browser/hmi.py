"""The HMI as an operator uses it, and its pixels."""

from __future__ import annotations

import io
import json
import os
import re
from base64 import b64decode
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from math import ceil, floor
from pathlib import Path
from typing import Any, Final, NamedTuple
from urllib.parse import urlsplit

from PIL import Image, ImageChops
from playwright.sync_api import Browser, CDPSession, Locator, Page, WebSocket, expect

from tests.support.waiting import PATIENCE_S, wait_for

Pixel = tuple[int, int, int]

# How each font of a page has loaded.
FONTS = "document.fonts.ready.then((all) => [...all].map(({ status }) => status))"
WIDE: Final = {"width": 1440, "height": 900}
PHONE: Final = {"width": 360, "height": 740}
# The console's message when a server has ended, at any point of an answer.
SERVER_GONE: Final = (
    r"net::ERR_(CONNECTION_|EMPTY_RESPONSE|INCOMPLETE_CHUNKED|CONTENT_LENGTH_MISMATCH)|WebSocket"
)
AXE: Final = Path(__file__).parents[2] / "node_modules/axe-core/axe.min.js"


@dataclass(frozen=True)
class View:
    """The map's position: its origin at (x, y) pixels of the map view, `scale` pixels a metre."""

    x: float
    y: float
    scale: float

    def pixel(self, x: float, y: float) -> tuple[int, int]:
        """The pixel of the map view at a point of the map frame, m."""
        return int(self.x + x * self.scale), int(self.y - y * self.scale)


@dataclass
class Hmi:
    """A page of the HMI, with its console, dialogs and requests."""

    page: Page
    url: str
    # Regular expressions of allowed console messages: a killed server may be logged.
    # On a busy machine, answers take so long that two pages have more under way than one address
    # may. They retry; the final result is what counts.
    allowed_noise: list[str] = field(default_factory=lambda: [r"429 \(Too Many Requests\)"])
    console: list[str] = field(default_factory=list)
    dialogs: list[str] = field(default_factory=list)
    requests: list[str] = field(default_factory=list)
    # All frames from its WebSockets, parsed.
    frames: list[dict[str, Any]] = field(default_factory=list)

    def __post_init__(self) -> None:
        def on_console(message: Any) -> None:
            if message.type in ("error", "warning"):
                self.console.append(f"{message.type}: {message.text} {message.location['url']}")

        def on_dialog(dialog: Any) -> None:
            self.dialogs.append(dialog.message)
            dialog.dismiss()

        def on_websocket(socket: WebSocket) -> None:
            self.requests.append(socket.url)
            socket.on("framereceived", lambda text: self.frames.append(json.loads(text)))

        self.page.on("console", on_console)
        self.page.on("pageerror", lambda error: self.console.append(f"uncaught: {error}"))
        self.page.on("dialog", on_dialog)
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.on("websocket", on_websocket)

    def go(self, fragment: str = "", query: str = "") -> None:
        """Load the page anew; a permalink's fragment comes without its `#`."""
        if self.page.url.partition("#")[0] == f"{self.url}/{query}":
            self.page.goto("about:blank")  # else only the fragment changes, nothing is loaded
        self.page.goto(f"{self.url}/{query}{'#' if fragment else ''}{fragment}")

    def turn(self, fragment: str) -> None:
        """Open another permalink in the same page: nothing is loaded anew."""
        self.page.goto(f"{self.url}/#{fragment}")
        self.view()  # which is that of a frame painted since

    def resize(self, width: int, height: int) -> None:
        """Resize the window; returns when the layout is finished."""
        self.page.set_viewport_size({"width": width, "height": height})
        self.page.wait_for_function(
            "size => innerWidth === size[0] && innerHeight === size[1]", arg=[width, height]
        )
        # The font may still be on its way; and a size observer may cause another layout.
        self.page.evaluate(
            "async () => { await document.fonts.ready;"
            " for (const _ of '12') await new Promise(requestAnimationFrame); }"
        )

    def address(self) -> str:
        address = self.page.evaluate("location.href")
        assert isinstance(address, str)
        return address

    def allow_noise(self, pattern: str) -> None:
        """Allow console messages that match, from now on and before."""
        self.allowed_noise.append(pattern)

    def check_manners(self) -> None:
        """Require a silent console, no dialog, and no request to another origin."""
        noise = [
            line for line in self.console if not any(re.search(p, line) for p in self.allowed_noise)
        ]
        assert not noise, "the console says:\n" + "\n".join(noise)
        assert self.dialogs == []
        own = urlsplit(self.url).netloc
        assert [
            url
            for url in self.requests
            if urlsplit(url).netloc != own and not url.startswith(("blob:", "data:", "about:"))
        ] == []

    @property
    def app(self) -> Locator:
        return self.page.get_by_test_id("app")

    def expect_phase(self, phase: str) -> None:
        """Wait until the page shows its connection in that phase."""
        patience_ms = PATIENCE_S * 1000
        expect(self.app).to_have_attribute("data-connection-state", phase, timeout=patience_ms)

    def expect(self, look: Callable[[], bool], what: str) -> None:
        """Wait for a condition that no locator can express."""
        # No sleep: Playwright delivers the page's events only during its calls.
        wait_for(look, what, meanwhile=lambda pause_s: self.page.wait_for_timeout(1000 * pause_s))

    def test_id(self, name: str) -> Locator:
        return self.page.get_by_test_id(name)

    def row(self, tag_id: str) -> Locator:
        return self.page.locator(f"tr[data-tag-id={json.dumps(tag_id)}]")

    def cell(self, tag_id: str, sensor: str) -> Locator:
        """A reading, without its trend."""
        return self.row(tag_id).locator(f"td[data-sensor={json.dumps(sensor)}] .reading")

    def card(self, tag_id: str) -> Locator:
        return self.page.locator(f"[data-testid=tag-card][data-tag-id={json.dumps(tag_id)}]")

    def rows(self) -> list[str]:
        """The ids in the table, from the top."""
        ids = self.page.locator("tbody tr[data-tag-id]").evaluate_all(
            "rows => rows.map(row => row.dataset.tagId)"
        )
        assert isinstance(ids, list)
        return ids

    def expect_rows(self, *tag_ids: str) -> None:
        """Wait until the table lists exactly these, in this order."""
        wait_for(lambda: self.rows() == list(tag_ids), f"the rows {tag_ids}")

    def expect_samples(self, count: int | None = None) -> None:
        """Wait for a field with that many contributing tags; None: any number."""
        number = r"\d+" if count is None else count
        expect(self.test_id("sample-count")).to_have_text(re.compile(rf"^{number} tags? contribut"))

    def expect_map(self) -> None:
        """Wait for the SLAM map, which is part of the whole view."""
        expect(self.page.locator(".map-panel")).to_have_attribute("data-map-state", "ready")

    def expect_parts(self) -> None:
        """Wait for the parts after the first view, which take room from it."""
        expect(self.page.locator("#help-dialog")).to_be_attached()
        # Its height changes once it is known whether there is a past.
        expect(self.page.locator(".timebar[data-state=waiting]")).to_have_count(0)

    def expect_layout(self) -> None:
        """Wait for all that takes room, the SLAM map and the font included."""
        self.expect_map()
        self.expect_parts()
        self.view()

    def choose_sensor(self, label: str) -> None:
        self.page.locator(".sensors label", has_text=label).click()

    def open_details(self, is_open: bool = True) -> None:
        """Open or close the legend's details, with its choice of colours."""
        if self.page.locator(".legend-facts").last.is_visible() != is_open:
            self.page.locator(".legend-more summary").click()

    def colour_by_value(self) -> None:
        """The page opens in the colours of the ideal range."""
        self.open_details()
        self.page.get_by_role("radio", name="Value").check()

    @property
    def map(self) -> Locator:
        return self.page.get_by_test_id("map")

    def view(self) -> View:
        """The map's position, in a layout that has its font and so its final size."""
        text = self.page.get_by_test_id("map-canvas").evaluate(
            """async (canvas) => {
              await document.fonts.ready;
              const frame = () => new Promise(requestAnimationFrame);
              await frame();
              await frame();
              return canvas.dataset.view;
            }"""
        )
        return View(*(float(part) for part in text.split(",")))

    def picture(self, width: int | None = None) -> Image.Image:
        """The map view as on the screen, with its buttons; one pixel a CSS pixel.

        With `width` only its left part.
        """
        box = self.map.bounding_box()
        assert box is not None
        left, top = floor(box["x"]), floor(box["y"])
        right, bottom = ceil(box["x"] + box["width"]), ceil(box["y"] + box["height"])
        clip = {"x": left, "y": top, "width": right - left, "height": bottom - top, "scale": 1}
        # Playwright's own screenshot takes twice the time, and tests take hundreds.
        taken = self._devtools.send(
            "Page.captureScreenshot", {"clip": clip, "format": "png", "optimizeForSpeed": True}
        )
        picture = Image.open(io.BytesIO(b64decode(taken["data"]))).convert("RGB")
        return picture if width is None else picture.crop((0, 0, width, picture.height))

    @cached_property
    def _devtools(self) -> CDPSession:
        return self.page.context.new_cdp_session(self.page)

    def settled_picture(self, width: int | None = None) -> Image.Image:
        """The map view of a live page once it has the SLAM map and stays the same.

        The heat map may come later still: see `expect_samples`.
        """
        self.expect_layout()
        looks: list[tuple[Image.Image, str | None]] = []

        def look() -> bool:
            # While a busy server sends nothing, the view is dimmed.
            looks.append((self.picture(width), self.app.get_attribute("data-connection-state")))
            return len(looks) > 2 and all(each == (looks[-1][0], "live") for each in looks[-3:])

        wait_for(look, "a picture that stays the same")
        return looks[-1][0]

    def expect_change(self, before: Image.Image) -> None:
        """Wait until the map view changes, if only on its way to something."""
        wait_for(
            lambda: changed_box(before, self.picture(before.width)) is not None,
            "a change of the map",
        )

    def lasting_change(self, before: Image.Image) -> Box:
        """Wait until the map view changes and settles; the box of the difference."""
        self.expect_change(before)
        box = wait_for(
            lambda: changed_box(before, self.settled_picture(before.width)), "a lasting change"
        )
        assert box is not None
        return box

    def expect_picture(self, wanted: Image.Image) -> None:
        """Wait until the map view equals that picture."""
        wait_for(
            lambda: changed_box(wanted, self.picture(wanted.width)) is None, "that very picture"
        )

    def pixels(self, points: Sequence[tuple[float, float]]) -> list[Pixel]:
        """Colours on the screen at points of the map frame, m."""
        view = self.view()
        picture = self.picture()
        return [_rgb(picture, *view.pixel(x, y)) for x, y in points]

    def pixel(self, x: float, y: float) -> Pixel:
        """The colour on the screen at a point of the map frame, m."""
        return self.pixels([(x, y)])[0]

    def expect_pixels(
        self, wanted: Callable[[Pixel], bool], *points: tuple[float, float], what: str
    ) -> None:
        """Wait until all points of the map frame have the wanted colours."""
        wait_for(lambda: all(wanted(pixel) for pixel in self.pixels(points)), f"{what} at {points}")

    def click_map(self, x: float, y: float) -> None:
        """Click on a point of the map frame, m."""
        left, top = self.view().pixel(x, y)
        self.map.click(position={"x": left, "y": top})

    def point_at(self, x: float, y: float) -> None:
        """Move the mouse to a point of the map frame, m."""
        left, top = self.view().pixel(x, y)
        self.map.hover(position={"x": left, "y": top})

    def tab_to(self, target: Locator) -> None:
        """Reach an element with the Tab key alone."""
        for _ in range(80):
            if target.evaluate("element => element === document.activeElement"):
                return
            self.page.keyboard.press("Tab")
        raise AssertionError(f"{target} was not reached")


# `open_page(url, fragment, query, **options)`, the fixture of `conftest.py`.
OpenPage = Callable[..., Hmi]


class Box(NamedTuple):
    """An upright box of pixels, right and bottom exclusive."""

    left: int
    top: int
    right: int
    bottom: int


def changed_box(before: Image.Image, now: Image.Image) -> Box | None:
    """The box of all pixels that differ; None where none does."""
    box = ImageChops.difference(before, now).getbbox()
    return box and Box(*box)


def _rgb(picture: Image.Image, x: int, y: int) -> Pixel:
    pixel = picture.getpixel((x, y))
    assert isinstance(pixel, tuple)
    return int(pixel[0]), int(pixel[1]), int(pixel[2])


LATE_ANSWERS: Final = """const real = fetch; fetch = async (...args) => {
  const answer = await real(...args);
  await new Promise((go) => setTimeout(go, 300 + 1200 * Math.random()));
  return answer; };"""


def slow_down(page: Page) -> None:
    """Slow down the page's scripts by `SLOW_PAGES`, and delay its answers."""
    if times := os.environ.get("SLOW_PAGES"):
        throttled = {"rate": float(times)}
        page.context.new_cdp_session(page).send("Emulation.setCPUThrottlingRate", throttled)
        page.add_init_script(LATE_ANSWERS)


@contextmanager
def open_hmi(
    browser: Browser,
    url: str,
    fragment: str = "",
    query: str = "",
    *,
    go: bool = True,
    **context: Any,
) -> Iterator[Hmi]:
    """A page in its own browser context; its console and requests are checked at the end.

    `context` are options of `Browser.new_context`; `go=False` leaves the page blank.
    """
    options = {"viewport": WIDE, "color_scheme": "light", "reduced_motion": "reduce", **context}
    with browser.new_context(**options) as own:
        page = own.new_page()
        page.set_default_timeout(PATIENCE_S * 1000)
        slow_down(page)
        hmi = Hmi(page, url)
        if go:
            hmi.go(fragment, query)
        yield hmi
        hmi.check_manners()


def slider(hmi: Hmi) -> Locator:
    return hmi.page.get_by_role("slider", name="Time shown")


def point(hmi: Hmi, share: float) -> tuple[float, float]:
    """The point of the page that far along the time bar."""
    box = slider(hmi).bounding_box()
    assert box is not None
    return box["x"] + share * box["width"], box["y"] + box["height"] / 2


def press_at(hmi: Hmi, share: float) -> None:
    """Go to the moment at that point."""
    hmi.page.mouse.click(*point(hmi, share))
