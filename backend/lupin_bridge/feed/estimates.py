"""Every sensor's report, every few seconds: which tags have changed, which estimates to trust.

Nothing here is on the way of a frame: what was found is passed to the judge when it is there.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Mapping
from typing import Final

from lupin_bridge.feed.shared_work import Periodic
from lupin_bridge.feed.source import TwinSource, TwinUnavailableError
from lupin_twin.core.past import NotRemembered
from lupin_twin.core.state import Snapshot
from lupin_twin.field.engine import FieldRefused
from lupin_twin.runtime.estimates import Report, ReportRequest

log = logging.getLogger(__name__)

# A report serves for 30 s at least (`estimate_service.REST_S`).
PERIOD_S: Final = 15.0
# A greenhouse has a handful of sensors; of more, the first in the alphabet.
MAX_SENSORS: Final = 32

# By tag and sensor: the reading since which it holds, ns of ROS time.
Changed = Mapping[str, Mapping[str, int]]


class EstimateFollower(Periodic):
    """Fetches reports from `start` to `stop`. Belongs to the event loop.

    `snapshot` gives the newest state; `on_changed` gets the tags that have changed, each time that
    they are others than before.
    """

    def __init__(
        self,
        source: TwinSource,
        snapshot: Callable[[], Snapshot | None],
        on_changed: Callable[[Changed], None],
        period_s: float = PERIOD_S,
    ) -> None:
        super().__init__(self.update, period_s, "what estimates are worth")
        self.known: dict[str, Report] = {}
        self._source = source
        self._snapshot = snapshot
        self._on_changed = on_changed
        self._changed: Changed = {}

    async def update(self) -> None:
        """Fetch the report of each sensor, one after the other."""
        snapshot = self._snapshot()
        if snapshot is None:
            return
        known: dict[str, Report] = {}
        for sensor in sensors_of(snapshot):
            try:
                known[sensor] = await self._source.estimate_report(ReportRequest(sensor))
            except (FieldRefused, NotRemembered, TwinUnavailableError) as error:
                log.debug("what estimates of %s are worth is not known: %s", sensor, error)
                if sensor in self.known:
                    known[sensor] = self.known[sensor]
        self.known = known
        changed = changed_of(known)
        if changed != self._changed:
            self._changed = changed
            self._on_changed(changed)


def sensors_of(snapshot: Snapshot) -> list[str]:
    """Those that estimates can be made of, at most `MAX_SENSORS`; 2 ms for 10,000 tags."""
    names = {
        reading.name
        for tag in snapshot.tags
        if tag.pose is not None
        for reading in tag.readings
        if math.isfinite(reading.value)
    }
    return sorted(names)[:MAX_SENSORS]


def changed_of(known: Mapping[str, Report]) -> Changed:
    """The tags that estimates do without, by tag and sensor."""
    changed: dict[str, dict[str, int]] = {}
    for sensor, report in known.items():
        for tag in report.tags:
            if tag.changed_since_ns is not None:
                changed.setdefault(tag.tag_id, {})[sensor] = tag.changed_since_ns
    return changed
