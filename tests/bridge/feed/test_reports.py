"""A report is asked for once for all, and kept for a moment."""

from __future__ import annotations

import asyncio
import time
from typing import Any

import pytest

from lupin_bridge.feed.estimates import FRESH_S, Reports
from lupin_twin.runtime.estimates import ReportRequest

CO2, LIGHT = ReportRequest("co2"), ReportRequest("light")


class Source:
    """Counts what it is asked, and answers when it may."""

    def __init__(self) -> None:
        self.asked: list[str] = []
        self.is_asked, self.may_answer = asyncio.Event(), asyncio.Event()
        self.may_answer.set()

    async def estimate_report(self, request: ReportRequest) -> Any:
        self.asked.append(request.sensor_type)
        self.is_asked.set()
        await self.may_answer.wait()
        return len(self.asked)


def test_all_who_ask_at_once_and_soon_after_get_one_answer(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    source: Any = Source()
    now_s = [time.monotonic()]
    monkeypatch.setattr(time, "monotonic", lambda: now_s[0])

    async def test() -> None:
        known: Any = Reports(source)
        source.may_answer.clear()
        both = asyncio.gather(known.of(CO2), known.of(CO2))
        await source.is_asked.wait()  # the work begins once both have asked
        source.may_answer.set()
        assert list(await both) == [1, 1]
        assert await known.of(CO2) == 1
        assert await known.of(LIGHT) == 2
        now_s[0] += FRESH_S
        assert await known.of(CO2) == 3

    asyncio.run(test())
    assert source.asked == ["co2", "light", "co2"]
