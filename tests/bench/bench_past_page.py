"""The page while its time bar is dragged: how many moments a second it shows, and how late.

Chromium draws without a GPU on this machine, beside the server. The journal has a day of 30 tags
and then of 10, as many as have one sensor in the demo: estimates cost by the readings.
"""

from __future__ import annotations

import statistics
import tempfile
import time
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

from playwright.sync_api import Browser, Page, expect, sync_playwright

from lupin_twin.core.state import Write
from lupin_twin.journal.runs import Clock
from tests.browser.conftest import CHROMIUM, CHROMIUM_ARGS
from tests.support.journal import SECOND, kept, pin, scan
from tests.support.messages import scan as observed
from tests.support.web import bridge

HOUSES: Final = (30, 10)
EVERY_S: Final = 120
DAY_S: Final = 86_400
DRAG_S: Final = 10

# When which moment came to be shown, ms of the page's clock.
WATCH: Final = """
window.came = [];
new MutationObserver(() => {
  const told = document.querySelector('[data-testid=app]')?.dataset.moment;
  if (told === 'now' || window.came.at(-1)?.[0] === told) return;
  window.came.push([told, performance.now()]);
}).observe(document, { subtree: true, attributes: true, attributeFilter: ['data-moment'] });
"""

# A finger that goes to and fro over the bar for so many seconds, a step a frame.
DRAG: Final = """
async (seconds) => {
  const bar = document.querySelector('[data-testid=timebar-slider]');
  const box = bar.getBoundingClientRect();
  bar.setPointerCapture = () => undefined;
  const send = (type, share) => bar.dispatchEvent(new PointerEvent(type, {
    bubbles: true, cancelable: true, button: 0, buttons: 1, pointerId: 1, pointerType: 'mouse',
    clientX: box.x + share * box.width, clientY: box.y + 30,
  }));
  const start = performance.now();
  window.came = [];
  send('pointerdown', 0.5);
  await new Promise((resolve) => {
    const frame = (now) => {
      send('pointermove', 0.5 + 0.45 * Math.sin((now - start) / 1500));
      if (now - start < seconds * 1000) requestAnimationFrame(frame);
      else resolve();
    };
    requestAnimationFrame(frame);
  });
  send('pointerup', 0.5);
  return window.came.map(([, at]) => at);
}
"""


def journal_of_a_day(path: Path, begun_s: int, tags: int) -> None:
    """Tags of five sensors, each scanned every two minutes."""
    begun_ns = begun_s * SECOND
    rows: list[Write] = [pin(str(tag), begun_ns, x=0.7 * tag) for tag in range(tags)]
    for number in range(DAY_S // EVERY_S):
        for tag in range(tags):
            at_ns = begun_ns + (number * EVERY_S + tag) * SECOND
            value = 18.0 + (number + tag) % 80 / 10
            rows.append(
                scan(
                    str(tag),
                    at_ns,
                    temperature=value,
                    humidity=50.0 + value,
                    co2=400.0 + value,
                    light=900.0 - value,
                    soil_moisture=40.0 + value / 10,
                )
            )
    kept(path, rows, Clock(begun_ns, begun_ns, is_simulated=False))


def print_dragging(page: Page, what: str) -> None:
    """Moments shown a second while the bar is dragged, and the pauses between two."""
    came: list[Any] = page.evaluate(DRAG, DRAG_S)
    gaps = sorted(b - a for a, b in pairwise(came))
    print(
        f"dragging the time bar, {what}: {len(came) / DRAG_S:.1f} moments/s "
        f"(to reach: 10), a pause of {statistics.median(gaps):.0f} ms in the middle, "
        f"{gaps[int(0.99 * len(gaps))]:.0f} ms at 99 %, {gaps[-1]:.0f} ms at most"
    )


def measure(browser: Browser, tags: int) -> None:
    """With the field, twice, and with the estimate."""
    with tempfile.TemporaryDirectory() as folder:
        journal = Path(folder) / "journal.sqlite"
        journal_of_a_day(journal, int(time.time()) - DAY_S, tags)
        with bridge("--ros-args", "-p", f"journal:={journal}") as running:
            running.peer.observe(observed("0", {"temperature": 20.0}))
            running.tag("0", lambda tag: tag["readings"][0]["value"] == 20.0)
            page = browser.new_page(viewport={"width": 1440, "height": 900})
            page.add_init_script(WATCH)
            page.goto(running.url)
            expect(page.get_by_test_id("timebar")).to_have_attribute("data-state", "ready")
            print_dragging(page, f"{tags} tags, for the first time")
            print_dragging(page, f"{tags} tags, once more")
            page.get_by_test_id("heat-legend").select_option("estimate")
            expect(page.get_by_test_id("estimate-key")).to_be_visible()
            print_dragging(page, f"{tags} tags, with the estimate")
            page.close()


def main() -> None:
    """Measure and print."""
    with (
        sync_playwright() as playwright,
        playwright.chromium.launch(
            executable_path=CHROMIUM, args=list(CHROMIUM_ARGS), headless=True
        ) as browser,
    ):
        for tags in HOUSES:
            measure(browser, tags)


if __name__ == "__main__":
    main()
