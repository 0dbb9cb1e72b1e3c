"""A sensor's report, asked for once for all who want it, and kept for a moment."""

from __future__ import annotations

import time
from collections import OrderedDict
from typing import Final

from lupin_bridge.twin.shared import Shared
from lupin_bridge.twin.source import TwinSource
from lupin_twin.estimate_report import Report, ReportRequest

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
