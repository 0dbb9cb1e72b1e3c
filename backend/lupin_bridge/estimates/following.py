"""Sensors with news are asked after every few seconds: which tags have changed, who is not trusted.

Those without are too, half as often: a model that is fitted anew may find what the one before did
not, long after the last reading. Nothing here is on the way of a frame: what was found is told to
the judge when it is there.
"""

from __future__ import annotations

import asyncio
import logging
import math
import time
from collections import OrderedDict
from collections.abc import Callable, Mapping
from typing import Final

from lupin_bridge.twin.shared import Shared
from lupin_bridge.twin.source import TwinSource, TwinUnavailableError
from lupin_twin.estimate_report import Report, ReportRequest
from lupin_twin.fields import FieldRefused
from lupin_twin.past import NotRemembered
from lupin_twin.state import Snapshot
from lupin_twin.workers import in_turns

# A twin's next round comes no sooner.
FRESH_S: Final = 2.0
MAX_KEPT: Final = 64


class Reports:
    """The reports of a source. Belongs to the event loop."""

    def __init__(self, source: TwinSource) -> None:
        self._source = source
        self._asking: Shared[Report] = Shared()
        self._kept: OrderedDict[ReportRequest, tuple[float, Report]] = OrderedDict()

    async def of(self, request: ReportRequest) -> Report:
        """What is known of a sensor's estimates.

        Raises:
            Exception: see `TwinSource.estimate_report`.

        """
        kept = self._kept.get(request)
        if kept is not None and time.monotonic() - kept[0] < FRESH_S:
            return kept[1]
        return await self._asking.get(request, lambda: self._ask(request))

    async def _ask(self, request: ReportRequest) -> Report:
        report = await self._source.estimate_report(request)
        self._kept[request] = time.monotonic(), report
        self._kept.move_to_end(request)
        if len(self._kept) > MAX_KEPT:
            self._kept.popitem(last=False)
        return report


log = logging.getLogger(__name__)

PERIOD_S: Final = 10.0
# A house has a handful of sensors; of more, the first in the alphabet.
MAX_SENSORS: Final = 32
# What looking for news takes for each tag, roughly and at worst.
_LOOK_TAG_S: Final = 5e-6

# By tag and sensor: the reading since which it holds, ns of ROS time.
Changed = Mapping[str, Mapping[str, int]]


class EstimateFollower:
    """Asks from `start` to `stop`. Belongs to the event loop.

    `snapshot` gives the newest state, `on_changed` is told which tags have changed each time that
    this is another answer than before.
    """

    def __init__(
        self,
        source: TwinSource,
        reports: Reports,
        snapshot: Callable[[], Snapshot | None],
        on_changed: Callable[[Changed], None],
        period_s: float = PERIOD_S,
    ) -> None:
        self.known: dict[str, Report] = {}
        self._source = source
        self._reports = reports
        self._snapshot = snapshot
        self._on_changed = on_changed
        self._period_s = period_s
        self._seen: dict[str, int] = {}
        # Had no news at the last look, and was left out of it.
        self._passed_over: set[str] = set()
        self._told: Changed = {}
        self._task: asyncio.Task[None] | None = None

    def start(self) -> None:
        """Begin; the first answer comes after a period."""
        self._task = asyncio.create_task(self._follow(), name="estimates")

    async def stop(self) -> None:
        """End."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.wait((self._task,))

    async def look(self) -> None:
        """Ask after those whose turn it is, one after the other."""
        snapshot = self._snapshot()
        if snapshot is None:
            return
        newest = await asyncio.wrap_future(
            self._source.workers.submit(
                lambda _: newest_of(snapshot), len(snapshot.tags) * _LOOK_TAG_S
            )
        )
        self.known = {name: report for name, report in self.known.items() if name in newest}
        self._seen = {name: at_ns for name, at_ns in self._seen.items() if name in newest}
        before, self._passed_over = self._passed_over, set()
        for sensor in sorted(newest)[:MAX_SENSORS]:
            has_news = self._seen.get(sensor) != newest[sensor] or not self._is_settled(sensor)
            if not has_news and sensor not in before:
                self._passed_over.add(sensor)
                continue
            try:
                self.known[sensor] = await self._reports.of(ReportRequest(sensor))
            except (FieldRefused, NotRemembered, TwinUnavailableError) as error:
                log.debug("what estimates of %s are worth is not known: %s", sensor, error)
                continue
            self._seen[sensor] = newest[sensor]
        changed = changed_of(self.known)
        if changed != self._told:
            self._told = changed
            self._on_changed(changed)

    def _is_settled(self, sensor: str) -> bool:
        """Whether the twin had learnt of the newest reading when it was asked last."""
        known = self.known.get(sensor)
        return known is not None and known.at_ns >= self._seen[sensor]

    async def _follow(self) -> None:
        while True:
            await asyncio.sleep(self._period_s)
            try:
                await self.look()
            except Exception:  # nobody waits for this task: the next look comes whatever it was
                log.exception("what estimates are worth is not known")


def newest_of(snapshot: Snapshot) -> dict[str, int]:
    """When each sensor was read last anywhere, ns; for a worker."""
    newest: dict[str, int] = {}
    for tag in in_turns(snapshot.tags):
        if tag.pose is None:
            continue
        for reading in tag.readings:
            if math.isfinite(reading.value):
                at_ns = reading.observed_at_ns or 0
                newest[reading.name] = max(newest.get(reading.name, 0), at_ns)
    return newest


def changed_of(known: Mapping[str, Report]) -> Changed:
    """The tags that estimates do without, by tag and sensor."""
    changed: dict[str, dict[str, int]] = {}
    for sensor, report in known.items():
        for tag in report.tags:
            if tag.changed_since_ns is not None:
                changed.setdefault(tag.tag_id, {})[sensor] = tag.changed_since_ns
    return changed
