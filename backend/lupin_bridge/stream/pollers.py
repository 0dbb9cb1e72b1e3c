"""Polls the log for the quality of estimates, and the twin for what the robot reports of itself.

Has the types of both for the web contract (see `schema`), and the polling loops.

No state frame waits for this: the judge gets a result when it has come.
"""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Awaitable, Callable, Mapping
from typing import Any, Final

import orjson
from pydantic import Field

from lupin_bridge.feed.source import Position, Robot, RobotLog, TwinSource, TwinUnavailableError
from lupin_bridge.feed.tasks import Periodic
from lupin_bridge.stream.frames import text_frame
from lupin_bridge.stream.hub import Hub
from lupin_bridge.stream.schema import Contract, Time
from lupin_bridge.stream.state_json import stamp
from lupin_twin.core.past import NotRemembered, PastRefused
from lupin_twin.core.state import Snapshot
from lupin_twin.field.engine import FieldRefused
from lupin_twin.runtime import estimates
from lupin_twin.runtime.estimates import Report


class GetEstimateResponse(Contract):
    """GetEstimate's response. A refusal has `ok` false, the reason, and everything else zero."""

    ok: bool
    error_message: str
    mean: list[float | None] = Field(description="sensor's unit, row-major, row 0 at bbox_min_y")
    sd: list[float | None] = Field(
        description="sensor's unit, as mean; the true value is within 1.645 sd 9 times in 10"
    )
    width: int
    height: int
    origin_x: float
    origin_y: float
    resolution_used: float
    sd_known: float = Field(description="a cell is known only if its sd is below this")
    sample_count: int = Field(description="tags that contribute")
    reading_count: int = Field(description="readings that contribute")


class Graded(Contract):
    """Scans predicted from earlier ones of other tags, and how many were in the 90 % interval."""

    scans: int
    inside: int


class EstimateQuality(Contract):
    """How often a sensor's estimates were right; a day lasts the twin's `day_length_s`."""

    fitted_at: Time | None = Field(
        description="the moment of the report; null: no model can be fitted"
    )
    fit_problem: str = Field(description="why the fit failed; empty: it did not")
    graded_since: Time | None = Field(description="first scan that was compared; null: none")
    day: Graded
    week: Graded
    share_day: float | None = Field(description="inside divided by scans; null: no scans")
    share_week: float | None
    is_trusted: bool | None = Field(
        description="false: a share is below 0.8, so the intervals are too narrow; null: fewer "
        "than 40 scans could be compared with other tags, so nothing is claimed"
    )


class EstimateQualities(Contract):
    """`/api/estimate/quality`: the quality of each sensor's estimates."""

    sensors: dict[str, EstimateQuality]


class ExpectedReading(Contract):
    """A tag's newest reading beside the prediction from all others; sensor's unit."""

    measured: float
    observed_at: Time
    expected: float
    expected_sd: float = Field(description="includes the noise of a reading")
    z: float = Field(description="joint deviation of its latest readings, in sds")
    offset: float = Field(description="deviation of those readings")
    left_out: bool = Field(
        description="the sensor has changed: the estimate leaves out its readings since then"
    )


class ExpectedTags(Contract):
    """`/api/estimate/tags`: the expected reading of each tag with a place, as of a moment."""

    sensor_type: str
    at: Time
    tags: dict[str, ExpectedReading]


class AdvisedPlace(Contract):
    """A place where an additional tag would help; m, map frame."""

    x: float
    y: float
    error_ratio: float = Field(
        description="error with a tag there and at the places before it, divided by that without"
    )


class Advice(Contract):
    """`/api/estimate/advice`: where an additional tag would help most, the best place first."""

    sensor_type: str
    places: list[AdvisedPlace]


# --- every sensor's report, every few seconds -----------------------------------------------------

log = logging.getLogger(__name__)

PERIOD_S: Final = 15.0
# The reports of all sensors take at most a tenth of a core: a pause is that many times as long.
REST_FACTOR: Final = 9.0
# By tag and sensor: the time of the reading since which the sensor has changed, ns of ROS time.
Changed = Mapping[str, Mapping[str, int]]


class EstimatePoller(Periodic):
    """Makes every sensor's estimate report, from `start` to `stop`. Belongs to the event loop.

    `report_on` makes the report on a sensor as of a snapshot, and `snapshot` returns the newest.
    `on_changed` gets the tags whose sensors have changed.
    """

    def __init__(
        self,
        report_on: Callable[[str, Snapshot], Awaitable[Report]],
        snapshot: Callable[[], Snapshot | None],
        on_changed: Callable[[Changed], None],
    ) -> None:
        super().__init__(self._poll, PERIOD_S, "what estimates are worth")
        self.known: dict[str, Report] = {}
        self._report_on = report_on
        self._snapshot = snapshot
        self._on_changed = on_changed

    async def _poll(self) -> None:
        begun_s = time.monotonic()
        await self.update()
        await asyncio.sleep(REST_FACTOR * (time.monotonic() - begun_s))

    async def update(self) -> None:
        """Make the report of each sensor, one after the other."""
        snapshot = self._snapshot()
        if snapshot is None:
            return
        known: dict[str, Report] = {}
        for name in estimates.sensors_of(snapshot):
            try:
                known[name] = await self._report_on(name, snapshot)
            except (FieldRefused, NotRemembered, PastRefused, TwinUnavailableError) as error:
                log.debug("what estimates of %s are worth is not known: %s", name, error)
                if name in self.known:
                    known[name] = self.known[name]
        self.known = known
        self._on_changed(changed_of(known))


def changed_of(known: Mapping[str, Report]) -> Changed:
    """The changed sensors, which estimates leave out, by tag and sensor."""
    changed: dict[str, dict[str, int]] = {}
    for sensor, report in known.items():
        for tag_id, since_ns in estimates.changed_of(report.tags).items():
            changed.setdefault(tag_id, {})[sensor] = since_ns
    return changed


# --- the robot ------------------------------------------------------------------------------------


def robot_body(known: RobotLog) -> bytes:
    """`routes_schema.Robot`."""
    return orjson.dumps({**_now(known.now), "trail": [_point(it) for it in known.trail]})


def _now(now: Robot) -> dict[str, Any]:
    position, plan, battery = now.position, now.plan, now.battery
    return {
        "position": position
        and {
            **_point(position),
            "heading": None if position.heading is None else round(position.heading, 3),
        },
        "plan": plan
        and {
            "points": [(round(x, 2), round(y, 2)) for x, y in plan.points],
            "observed_at": stamp(plan.at_ns),
        },
        "battery": battery
        and {"percent": round(battery.percent, 1), "observed_at": stamp(battery.at_ns)},
    }


def _point(at: Position) -> dict[str, Any]:
    return {"x": round(at.x, 2), "y": round(at.y, 2), "observed_at": stamp(at.at_ns)}


# Interval of polling the robot's topics: its frames come no more often.
ROBOT_PERIOD_S: Final = 1.0


class RobotPoller(Periodic):
    """Keeps what is known of the robot, and publishes a frame when any of it has changed.

    `now_ns()` is the twin's time; None: not known. `clock` returns monotonic seconds. Belongs to
    the event loop.
    """

    def __init__(
        self,
        source: TwinSource,
        hub: Hub,
        now_ns: Callable[[], int | None],
        clock: Callable[[], float],
    ) -> None:
        super().__init__(self._look, ROBOT_PERIOD_S, "what the robot says of itself")
        self.log = RobotLog()
        self._source = source
        self._hub = hub
        self._now_ns = now_ns
        self._clock = clock

    async def _look(self) -> None:
        now_ns = self._now_ns()
        try:
            reported = await self._source.robot(now_ns)
        except TwinUnavailableError:  # the ROS thread has ended, which the status reports
            return
        if reported is not None and self.log.take(reported, now_ns):
            frame = orjson.dumps({"type": "robot", **_now(self.log.now)})
            self._hub.publish_beside("robot", text_frame(frame), self._clock())
