"""The demo in the browser: the real patrol, faster than for people."""

import json
import re
import signal
from importlib.resources import files
from pathlib import Path
from typing import Any

from playwright.sync_api import expect

from tests.browser.hmi import SERVER_GONE, Hmi, OpenPage
from tests.support.processes import lupin_twin, url_of

NO_JOURNAL = ("--ros-args", "-p", "journal:=off")
WATCH_PESTS = """
() => {
  window.pests = { seen: [], cleared: [] };
  new MutationObserver((changes) => {
    for (const { target, oldValue } of changes) {
      const now = target.dataset.pest;
      if (now === oldValue) continue;
      (now === 'true' ? window.pests.seen : window.pests.cleared).push(target.dataset.tagId);
    }
  }).observe(document.querySelector('tbody'), {
    attributeFilter: ['data-pest'], attributeOldValue: true, subtree: true,
  });
}
"""


def simulated_tags() -> dict[str, set[str]]:
    """The simulator's own list: the sensors of each tag."""
    path = files("greenhouse_sim") / "configs/tag_locations.json"
    listed: Any = json.loads(Path(str(path)).read_text(encoding="utf-8"))
    return {str(tag_id): set(tag["sensors"]) for tag_id, tag in listed["tags"].items()}


def sensors_shown(hmi: Hmi) -> dict[str, set[str]]:
    """The sensors that the table has a number of, for each tag."""
    rows: dict[str, list[str]] = hmi.page.evaluate(
        """() => Object.fromEntries(
          [...document.querySelectorAll('tbody tr[data-tag-id]')].map((row) => [
            row.dataset.tagId,
            [...row.querySelectorAll('td[data-sensor]')]
              .filter((cell) => /[0-9]/.test(cell.textContent))
              .map((cell) => cell.dataset.sensor),
          ]),
        )"""
    )
    return {tag_id: set(sensors) for tag_id, sensors in rows.items()}


def unbidden(output: str) -> list[str]:
    """Lines of a log that say something went wrong, beside what a busy machine makes true.

    And beside what is true of a robot in a hurry: its day is not as long as the twin believes.
    """
    return [
        line
        for line in output.splitlines()
        if re.search(r"warn|error|critical|traceback|exception", line, re.IGNORECASE)
        and not re.search(r"left behind|fallen silent|estimate of .* not to be trusted", line)
    ]


def test_a_demo_fills_the_page_a_pest_comes_and_goes_and_all_ends_with_it(
    domain: int, open_page: OpenPage
) -> None:
    tags = simulated_tags()
    assert len(tags) == 29
    # By this seed, a tag that is shown already has a pest in the second pass, and later none.
    with lupin_twin(domain, "demo", "--speed", "15", "--seed", "8", *NO_JOURNAL) as demo:
        hmi = open_page(url_of(demo))
        hmi.expect_phase("live")
        hmi.page.evaluate(WATCH_PESTS)
        hmi.expect(lambda: sensors_shown(hmi) == tags, "every tag with its sensors")
        expect(hmi.page.locator("tbody tr[data-pinned=true]")).to_have_count(29)
        expect(hmi.page.locator("tbody .cell-species bdi")).to_have_count(29)
        expect(hmi.test_id("notice")).to_have_count(0)
        expect(hmi.test_id("origin")).to_contain_text("Simulated")
        for label, name in (
            ("Temperature", "temperature"),
            ("CO₂", "co2"),
            ("Soil moisture", "soil_moisture"),
        ):
            hmi.choose_sensor(label)
            hmi.expect_samples(sum(name in sensors for sensors in tags.values()))
        hmi.page.wait_for_function(
            "() => window.pests.seen.some((tag) => window.pests.cleared.includes(tag))"
        )
        hmi.check_manners()
        hmi.allow_noise(SERVER_GONE)
        # What waits as it ends, the page's later parts among it: they are asked for again.
        hmi.allow_noise(r"503 .*/(api/|assets/|lupin\.svg)|Refused to apply style .*/assets/")
        assert demo.stop(signal.SIGINT) == 0
        hmi.expect_phase("reconnecting")
        assert unbidden(demo.output) == []
