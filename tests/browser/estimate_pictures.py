"""The estimate in pictures, for the docs: early, with the robot dead, one sensor changed.

The journal is the demo's simulated past without its last six hours: two
of the pictures look back at it. Its last minutes are not in the journal: they happen while
the pictures are taken, scan by scan, so that predictions are graded by readings that the
greenhouse really had then. For the last picture, a tag with a faulty sensor is scanned.
"""

import io
import tempfile
import time
from collections.abc import Iterable
from functools import partial
from pathlib import Path
from typing import Any, Final

from greenhouse_sim.simulator import GreenhouseSimulator
from PIL import Image
from playwright.sync_api import Browser, expect

from lupin_patrol.greenhouse import read_greenhouse
from lupin_patrol.mission import past
from lupin_patrol.perception import FREE, OCCUPIED, RESOLUTION_M
from lupin_twin.core.state import Observation, Write
from lupin_twin.journal.runs import Clock
from tests.support.journal import SECOND, append
from tests.support.messages import occupancy_grid, pose, scan
from tests.support.waiting import wait_for
from tests.support.web import Bridge, bridge, filled

# The patrol's day, s; its past is three of them.
DAY_S: Final = 1_440
# As many simultaneous scans as the twin's queue surely holds.
LOT: Final = 25
# The journal ends this long before now: time for some fifty scans of temperature to be graded.
GRADED_S: Final = 180
HOUR_S: Final = DAY_S / 24
# How much of the past is still to come: longer than the pictures take.
AHEAD_S: Final = 600
# Seconds before now: the patrol begins, stands still in the afternoon, goes on at night.
BEGUN_S: Final = 3 * DAY_S - AHEAD_S
STOPPED_S: Final = 42 * HOUR_S - AHEAD_S
RESUMED_S: Final = STOPPED_S - 6 * HOUR_S
CHANGED_TAG: Final = "5"
CHANGED_BY: Final = 6.0
# Its scan interval then, s.
CHANGED_SCANS: Final = 5
APART_S: Final = 2
READY_S: Final = 120.0
# How long before now each picture is, s.
PAST: Final = {"estimate-early": BEGUN_S - 16, "estimate-dead": RESUMED_S + 1}


def taken(browser: Browser, folder: Path) -> None:
    """Write the three pictures."""
    with tempfile.TemporaryDirectory() as home:
        journal = Path(home) / "journal.sqlite"
        now_ns = time.time_ns()
        reported, end_ns = remembered(now_ns), now_ns - GRADED_S * SECOND
        known = [row for row in reported if row.stamp_ns <= end_ns]
        robot = Robot(
            row
            for row in reported
            if isinstance(row, Observation) and not row.kind and row.stamp_ns > end_ns
        )
        append(journal, known, Clock(now_ns, now_ns, is_simulated=False))
        day = ("-p", f"day_length_s:={DAY_S}.0")
        with bridge("--ros-args", "-p", f"journal:={journal}", *day) as running:
            running.peer.publish_map(greenhouse_map())
            wait_for(lambda: is_fitted(running), "a model, and the map", READY_S)
            for name, before_s in PAST.items():
                robot.go_on(running)
                at_s = now_ns / SECOND - before_s
                picture(browser, running.url, folder / f"{name}.png", f"&at={at_s:.0f}")
            robot.go_on(running)
            scan_wrongly(running)
            wait_for(lambda: has_changed(running), "the sensor that has changed", READY_S)
            picture(browser, running.url, folder / "estimate-changed.png", f"&tag={CHANGED_TAG}")


class Robot:
    """Publishes the scans of the simulated past when their time has come."""

    def __init__(self, scans: Iterable[Observation]) -> None:
        self._scans = sorted(scans, key=lambda each: each.stamp_ns)

    def go_on(self, running: Bridge) -> None:
        """Publish every scan that is due."""
        now_ns = time.time_ns()
        due = [each for each in self._scans if each.stamp_ns <= now_ns]
        self._scans = self._scans[len(due) :]
        for start in range(0, len(due), LOT):
            lot = due[start : start + LOT]
            running.peer.observe(*map(message_of, lot))
            running.tag(lot[-1].tag_id, partial(is_reported, lot[-1]))


def message_of(row: Observation) -> Any:
    return scan(row.tag_id, row.readings, status=row.status, stamp_s=row.stamp_ns / SECOND)


def is_reported(row: Observation, tag: dict[str, Any]) -> bool:
    attempted = filled(tag)["last_try"]
    return attempted is not None and attempted["sec"] >= row.stamp_ns // SECOND


def remembered(now_ns: int) -> list[Write]:
    """What the twin restores, and what is to come until `AHEAD_S` from now."""
    return [
        row
        for row in past(GreenhouseSimulator(), 0, 60.0, 1.0, now_ns + AHEAD_S * SECOND)
        if not RESUMED_S < (now_ns - row.stamp_ns) / SECOND < STOPPED_S
    ]


def scan_wrongly(running: Bridge) -> None:
    """Let the robot scan the tag with the faulty sensor, again and again."""
    now_s = time.time()
    tags = {each["tag_id"]: each for each in running.json("/api/state")["tags"]}
    readings = {each["name"]: each["value"] for each in tags[CHANGED_TAG]["readings"]}
    wrong = {**readings, "temperature": readings["temperature"] + CHANGED_BY}
    for number in range(CHANGED_SCANS, 0, -1):
        running.peer.observe(scan(CHANGED_TAG, wrong, stamp_s=now_s - number * APART_S))


def greenhouse_map() -> object:
    """The greenhouse's floor within its walls."""
    inside = read_greenhouse(GreenhouseSimulator()).interior
    columns, lines = (
        2 + round(extent / RESOLUTION_M)
        for extent in (inside.x1 - inside.x0, inside.y1 - inside.y0)
    )
    wall = [OCCUPIED] * columns
    floor = [[OCCUPIED, *[FREE] * (columns - 2), OCCUPIED] for _ in range(lines - 2)]
    corner = pose(inside.x0 - RESOLUTION_M, inside.y0 - RESOLUTION_M)
    return occupancy_grid([wall, *floor, wall], RESOLUTION_M, corner)


def is_fitted(running: Bridge) -> bool:
    """Whether there are a map and a model."""
    if running.get("/api/map").status_code != 200:
        return False
    sensors = running.json("/api/estimate/quality")["sensors"]
    return sensors.get("temperature", {}).get("fitted_at") is not None


def has_changed(running: Bridge) -> bool:
    """Whether the estimate leaves the tag out, and the page shows it."""
    tags = running.json("/api/estimate/tags", sensor_type="temperature")["tags"]
    reported = running.json("/api/health")["tags"][CHANGED_TAG].get("reasons", ())
    return tags[CHANGED_TAG]["left_out"] and any(each["kind"] == "changed" for each in reported)


def picture(browser: Browser, url: str, path: Path, link: str) -> None:
    """The map with the estimate, once it is there; of a chosen tag the whole page."""
    has_card = "tag=" in link
    context = browser.new_context(
        viewport={"width": 1280, "height": 800 if has_card else 1000},
        color_scheme="light",
        reduced_motion="reduce",
    )
    page = context.new_page()
    advice = ",advice" if has_card else ""
    page.goto(f"{url}/#heat=estimate&layers=map,field,unknown,grid,boxes,pins,labels{advice}{link}")
    expect(page.get_by_test_id("estimate-key")).to_be_visible()
    if has_card:
        expect(page.locator("[data-left-out]")).to_be_visible()
        expect(page.get_by_test_id("advice")).to_be_visible()
    page.wait_for_load_state("networkidle")
    page.evaluate("document.fonts.ready.then(() => new Promise(requestAnimationFrame))")
    # A new alarm's note over the past.
    for close in page.locator(".meanwhile .icon-button:visible").all():
        close.click()
    shown = page.screenshot() if has_card else page.locator(".map-panel").screenshot()
    save(shown, path)
    context.close()


def save(png: bytes, path: Path) -> None:
    """Write a screenshot for the docs: 256 colours, a third of the bytes."""
    picture = Image.open(io.BytesIO(png)).convert("RGB")
    picture.quantize(256, dither=Image.Dither.NONE).save(path, optimize=True)
