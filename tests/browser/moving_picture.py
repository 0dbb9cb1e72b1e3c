"""The README's animation of the page, from a demo: live, a tag, the estimate, the past.

`python -m tests.browser.screenshots` makes it with the others.
"""

import io
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from PIL import Image
from playwright.sync_api import Browser, Page, ViewportSize, expect

SIZE: Final[ViewportSize] = {"width": 1600, "height": 1000}
# Its size in the README, pixels; and the quality of its colours, of 100.
WIDTH: Final = 1000
QUALITY: Final = 55
MAX_BYTES: Final = 1_500_000
# How long a frame is shown, ms: one that moves by itself, and one to read.
MOVING: Final = 250
READ: Final = 2_000


def taken(browser: Browser, url: str, file: Path) -> None:
    """Write the picture.

    Raises:
        ValueError: it is larger than a README should be.

    """
    context = browser.new_context(
        viewport=SIZE, color_scheme="light", reduced_motion="reduce", locale="en-GB"
    )
    page = context.new_page()
    page.goto(url)
    expect(page.get_by_test_id("sample-count")).to_contain_text("contribute")
    shots = [(shrunk(page.screenshot()), shown_ms) for shown_ms in scenes(page)]
    context.close()
    pictures, times = zip(*shots, strict=True)
    pictures[0].save(
        file, save_all=True, append_images=pictures[1:], duration=list(times), loop=0,
        quality=QUALITY, method=6,
    )  # fmt: skip
    if file.stat().st_size > MAX_BYTES:
        raise ValueError(f"{file} has {file.stat().st_size} bytes, expected {MAX_BYTES} at most")


def shrunk(png: bytes) -> Image.Image:
    """A screenshot in the README's size."""
    picture = Image.open(io.BytesIO(png)).convert("RGB")
    size = WIDTH, round(WIDTH * picture.height / picture.width)
    return picture.resize(size, Image.Resampling.LANCZOS)


def scenes(page: Page) -> Iterator[int]:
    """Go from scene to scene; yields how long each view is shown, ms."""
    yield READ
    for _ in range(6):
        page.wait_for_timeout(1_000)
        yield 2 * MOVING
    page.get_by_test_id("map").focus()
    page.locator("tbody tr[data-pinned=true]").nth(2).click()
    expect(page.get_by_test_id("tag-card")).to_be_visible()
    expect(page.get_by_test_id("plot").last.locator("canvas")).to_be_visible()
    page.wait_for_load_state("networkidle")
    yield READ
    page.keyboard.press("Escape")
    page.get_by_role("button", name="Layers").click()
    page.get_by_test_id("heat").select_option("estimate")
    page.keyboard.press("Escape")
    expect(page.get_by_test_id("estimate-key")).to_be_visible()
    page.wait_for_load_state("networkidle")
    page.wait_for_timeout(1_000)
    yield READ
    slider = page.get_by_role("slider", name="Time shown")
    slider.focus()
    for _ in range(16):
        for _ in range(3):
            page.keyboard.press("ArrowLeft")
        expect(slider).to_have_attribute("aria-valuetext", re.compile(r"^\d"))
        page.wait_for_load_state("networkidle")
        page.wait_for_timeout(300)
        yield MOVING
    yield READ
    page.keyboard.press("l")
    expect(slider).to_have_attribute("aria-valuetext", re.compile("^Live"))
    page.wait_for_load_state("networkidle")
    yield READ
