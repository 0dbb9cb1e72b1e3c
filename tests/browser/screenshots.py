"""Pictures of the HMI from the real demo: `python -m tests.browser.screenshots FOLDER`.

One for each size, light and dark, and the wide one as people with the common kinds of colour
blindness see it. To be looked at; those for the README are written to `frontend/docs` with
`--readme`.
"""

from __future__ import annotations

import argparse
import io
import sys
from pathlib import Path

from PIL import Image
from playwright.sync_api import Browser, Page, ViewportSize, expect, sync_playwright

from tests.browser.conftest import CHROMIUM, CHROMIUM_ARGS
from tests.support.domains import own_domain, ros_env
from tests.support.processes import Process, lupin_twin, url_of
from tests.support.state_home import use_own

SIZES = ((360, 740), (820, 1180), (1440, 900), (1920, 1080))
BLINDNESS = ("protanopia", "deuteranopia", "tritanopia", "achromatopsia")
README = Path(__file__).parents[2] / "frontend/docs"
# The second pass of the patrol brings pests, failed scans and ages that differ.
PATROL_SPEED = 3
PATIENCE_MS = 120_000
ALL_LAYERS = "map,field,smooth,grid,boxes,blooms,pins,labels"
CARD = f"/#sensor=soil_moisture&tag=5&layers={ALL_LAYERS}"


def main() -> int:
    """Take them all."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--readme", action="store_true", help="also write those of the README")
    options = parser.parse_args()
    use_own()
    options.folder.mkdir(parents=True, exist_ok=True)
    expect.set_options(timeout=PATIENCE_MS)
    patrol = [sys.executable, "-m", "lupin_patrol", "--speed", str(PATROL_SPEED)]
    with (
        own_domain() as domain,
        lupin_twin(domain, "serve") as server,
        Process(patrol, ros_env(domain)),
        sync_playwright() as playwright,
        playwright.chromium.launch(
            executable_path=CHROMIUM, args=list(CHROMIUM_ARGS), headless=True
        ) as browser,
    ):
        url = url_of(server)
        wait_for_second_pass(browser, url)
        for size in SIZES:
            for scheme in ("light", "dark"):
                views(browser, url, options.folder, size, scheme)
        blindness(browser, url, options.folder)
        if options.readme:
            readme(browser, url)
    return 0


def wait_for_second_pass(browser: Browser, url: str) -> None:
    """Wait until every tag is known and a pest is to be seen."""
    page = opened(browser, url, (1440, 900), "light")
    expect(page.locator("tbody tr[data-pinned=true]")).to_have_count(29)
    expect(page.locator("tbody .cell-species bdi")).to_have_count(29)
    expect(page.locator("tbody tr[data-pest=true]").first).to_be_attached()
    page.context.close()


def opened(browser: Browser, url: str, size: tuple[int, int], scheme: str, path: str = "/") -> Page:
    """A page of that size, once its heat map is there."""
    width, height = size
    viewport: ViewportSize = {"width": width, "height": height}
    context = browser.new_context(
        viewport=viewport,
        color_scheme="dark" if scheme == "dark" else "light",
        reduced_motion="reduce",
        device_scale_factor=2 if width < 600 else 1,
        is_mobile=width < 600,
        has_touch=width < 900,
    )
    page = context.new_page()
    page.set_default_timeout(PATIENCE_MS)
    page.goto(url + path)
    expect(page.get_by_test_id("sample-count")).to_contain_text("contribute")
    page.evaluate("document.fonts.ready.then(() => new Promise(requestAnimationFrame))")
    return page


def views(browser: Browser, url: str, folder: Path, size: tuple[int, int], scheme: str) -> None:
    """The page as it opens, with a tag chosen, smooth, and what belongs to its size."""
    width, height = size
    name = f"{width}x{height}-{scheme}"
    page = opened(browser, url, size, scheme)
    page.screenshot(path=folder / f"{name}.png")
    if width < 600:
        page.get_by_role("navigation").get_by_role("button", name="Tags").click()
        page.screenshot(path=folder / f"{name}-tags.png")
        page.get_by_role("navigation").get_by_role("button", name="Map").click()
    page.context.close()
    page = opened(browser, url, size, scheme, CARD)
    expect(page.get_by_test_id("tag-card")).to_be_visible()
    page.screenshot(path=folder / f"{name}-card.png")
    page.context.close()
    if width == 1440:
        page = opened(browser, url, size, scheme)
        page.get_by_role("radio", name="Fixed").check()
        page.get_by_role("button", name="Layers").click()
        page.screenshot(path=folder / f"{name}-layers.png")
        page.get_by_role("button", name="Menu").click()
        page.screenshot(path=folder / f"{name}-menu.png")
        page.keyboard.press("Escape")
        page.get_by_test_id("map").focus()
        page.keyboard.press("?")
        page.screenshot(path=folder / f"{name}-help.png")
        page.keyboard.press("Escape")
        page.context.set_offline(True)
        expect(page.get_by_test_id("frozen")).to_be_visible()
        page.screenshot(path=folder / f"{name}-frozen.png")
        page.context.close()
    if width == 1920:
        page = opened(browser, url, size, scheme, "/?kiosk=1#sensor=humidity")
        page.screenshot(path=folder / f"{name}-kiosk.png")
        page.context.close()


def blindness(browser: Browser, url: str, folder: Path) -> None:
    """The wide page, and the phone's, as Chromium emulates each kind."""
    for scheme in ("light", "dark"):
        page = opened(browser, url, (1440, 900), scheme, "/#tag=5")
        session = page.context.new_cdp_session(page)
        for kind in BLINDNESS:
            session.send("Emulation.setEmulatedVisionDeficiency", {"type": kind})
            page.screenshot(path=folder / f"1440x900-{scheme}-{kind}.png")
        page.context.close()


def readme(browser: Browser, url: str) -> None:
    """The README's pictures: all their colours, and still under 250 kB each."""
    README.mkdir(exist_ok=True)
    for name, size, scheme, path in (
        ("wide-light", (1280, 800), "light", "/"),
        ("wide-dark", (1280, 800), "dark", CARD),
        ("phone", (360, 740), "light", "/"),
    ):
        page = opened(browser, url, size, scheme, path)
        picture = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
        page.context.close()
        picture.save(README / f"{name}.png", optimize=True)


if __name__ == "__main__":
    sys.exit(main())
