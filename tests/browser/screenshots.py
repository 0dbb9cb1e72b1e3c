"""The docs' pictures of the page, from the real demo: `python -m tests.browser.screenshots`."""

import json
import sys
import time
from pathlib import Path
from urllib.request import urlopen

from playwright.sync_api import Browser, Page, ViewportSize, expect

from tests.browser import estimate_pictures, moving_picture
from tests.browser.conftest import chromium
from tests.support.domains import own_domain
from tests.support.processes import lupin_twin, url_of
from tests.support.state_home import use_own
from tests.support.waiting import wait_for

IMAGES = Path(__file__).parents[2] / "docs/images"
# The second round of the patrol brings pests, failed scans and different ages.
PATROL_SPEED = 3
PATIENCE_MS = 120_000


def main() -> int:
    """Take them all."""
    use_own()
    expect.set_options(timeout=PATIENCE_MS)
    with (
        own_domain() as domain,
        lupin_twin(domain, "demo", "--speed", str(PATROL_SPEED)) as server,
        chromium() as browser,
    ):
        url = url_of(server)
        wait_for_second_pass(browser, url)
        of_the_page(browser, url)
        estimate_pictures.taken(browser, IMAGES)
    return 0


def wait_for_second_pass(browser: Browser, url: str) -> None:
    """Wait until the robot has been everywhere, and so mapped it, and a pest is visible."""
    began_s = time.monotonic()

    def has_been_everywhere() -> bool:
        with urlopen(f"{url}/api/state") as answer:
            ages_s = [tag["stale_seconds"] for tag in json.load(answer)["tags"]]
        return len(ages_s) == 29 and max(ages_s) < time.monotonic() - began_s

    wait_for(has_been_everywhere, "a scan of every tag", PATIENCE_MS / 1000)
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


def past(url: str) -> str:
    """A link to the first day of the demo's past, with a tag's chart."""
    with urlopen(f"{url}/api/timeline") as answer:
        reach = json.load(answer)["reach"]
    begun_s, ended_s = reach["from"]["sec"], reach["to"]["sec"]
    at_s = begun_s + (ended_s - begun_s) // 2
    return f"/#at={at_s}&period=all&chart.tag=5&tag=5"


def of_the_page(browser: Browser, url: str) -> None:
    """The pictures of the demo's page, and the README's animation."""
    for name, size, scheme, path, part in (
        ("page", (1440, 900), "light", "/", "body"),
        ("past", (1280, 800), "dark", past(url), "body"),
        ("phone", (360, 740), "light", "/", "body"),
        ("wall", (1280, 720), "dark", "/?kiosk=1", "body"),
        ("map", (1280, 800), "light", "/", ".map-panel"),
        ("table", (1280, 800), "light", "/", ".tags-panel"),
        ("alarms", (1280, 800), "light", "/#list=alarms", ".tags-panel"),
    ):
        page = opened(browser, url, size, scheme, path)
        if "tag=" in path:
            expect(page.get_by_test_id("plot").last.locator("canvas")).to_be_visible()
        if name == "alarms":
            expect(page.locator("[data-alarm]").first).to_be_visible()
        # The time bar and the charts have their data.
        page.wait_for_load_state("networkidle")
        picture = page.locator(part).screenshot(scale="css")
        estimate_pictures.save(picture, IMAGES / f"{name}.png")
        page.context.close()
    moving_picture.taken(browser, url, IMAGES / "page.webp")


if __name__ == "__main__":
    sys.exit(main())
