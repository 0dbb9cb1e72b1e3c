"""The page with a large greenhouse: its cost on the main thread when nothing, or little, happens.

Except for the heartbeat it is thread time of all tasks, so that other load does not count.
"""

import time
from collections.abc import Callable

from playwright.sync_api import CDPSession, Page

from tests.bench.bench_page import page_of
from tests.bench.greenhouse_double import greenhouse_of
from tests.browser.conftest import chromium
from tests.support.web import bridge

SIZES = (1_000, 10_000)
BEATS = 8
MOVES = 60

# Until the page has taken the frame, ms, the median.
HEARTBEAT = """
async (times) => {
  const costs = [];
  for (let i = 0; i < times; i++) {
    await new Promise((resolve) => setTimeout(resolve, 1050));
    const start = performance.now();
    greenhouse.beat();
    await null; // what React does at once it does before that; no frame is asked for
    costs.push(performance.now() - start);
  }
  return costs.sort((a, b) => a - b)[Math.floor(times / 2)];
}
"""
SETTLED = "() => new Promise((r) => requestAnimationFrame(() => setTimeout(r, 50)))"


def main() -> None:
    with chromium() as browser, bridge() as running:
        for count in SIZES:
            with page_of(browser) as page:
                page.add_init_script(greenhouse_of(count))
                page.goto(running.url)
                page.locator("tr[data-tag-id]").first.wait_for()
                page.evaluate(SETTLED)
                session = page.context.new_cdp_session(page)
                session.send("Performance.enable", {"timeDomain": "threadTicks"})
                for what, ms in measure(page, session, count).items():
                    print(f"{count:,} tags, {what}: {ms:.1f} ms of main thread")


def measure(page: Page, session: CDPSession, count: int) -> dict[str, float]:
    """Main thread time, ms, of each kind of event."""

    def cost(action: Callable[[], object], times: int) -> float:
        before = busy_s(session)
        for _ in range(times):
            action()
        page.evaluate(SETTLED)
        return 1000 * (busy_s(session) - before) / times

    def frame(script: str) -> Callable[[], None]:
        def send() -> None:
            page.evaluate(script)
            time.sleep(1.05)  # a large greenhouse is shown once a second: one frame at a time

        return send

    box = page.get_by_test_id("map").bounding_box()
    assert box is not None
    steps = iter(range(10_000))

    def move() -> None:
        step = next(steps)
        x = box["x"] + 60 + (step * 37) % (box["width"] - 180)
        page.mouse.move(x, box["y"] + 60 + (step * 23) % (box["height"] - 180))

    # Ages tick by themselves, and reading the page costs something too.
    idle = cost(frame("greenhouse.idle()"), BEATS)
    return {
        "a heartbeat that changes nothing": page.evaluate(HEARTBEAT, BEATS),
        "a delta of 1 %": cost(frame(f"greenhouse.change({count // 100})"), BEATS) - idle,
        "a move of the mouse over the map": cost(move, MOVES),
    }


def busy_s(session: CDPSession) -> float:
    """Time that the page's main thread has spent in tasks so far, s."""
    metrics = session.send("Performance.getMetrics")["metrics"]
    return float(next(each["value"] for each in metrics if each["name"] == "TaskDuration"))
