"""What the judge learns of the time before the first state, and of a past that cannot be told."""

from __future__ import annotations

import asyncio
import logging
from typing import Any

import pytest

from lupin_bridge.feed.query import Itself
from lupin_bridge.feed.source import TwinUnavailableError
from lupin_bridge.judge.judging import Judge
from lupin_bridge.judge.scan_interval import LONGEST_NS
from lupin_bridge.past import recent_scans
from lupin_bridge.past.recent_scans import learn_recent
from lupin_twin.core.past import NotRemembered
from lupin_twin.core.state import Snapshot
from lupin_twin.core.writes import PastWrite, RecentRequest
from tests.support.seen import NOW_NS, SENSORS, S, by_light, tag

TAGS = ("a", "b")
HOUR_NS = 3_600 * S
FIRST = Snapshot(NOW_NS, "map", tuple(tag(tag_id, light=900.0) for tag_id in TAGS))


class Hesitant:
    """A past with errors before its first answers."""

    def __init__(self, *errors: Exception) -> None:
        self.asked: list[object] = []
        self.errors = list(errors)

    async def ask(self, question: Itself, cost_s: float) -> tuple[PastWrite, ...]:
        """What was recent: a scan an hour."""
        self.asked.append(question.need)
        if self.errors:
            raise self.errors.pop(0)
        assert cost_s > 0.0
        return tuple(
            PastWrite(back, 1, name, NOW_NS - back * HOUR_NS, 0, 0, ("light",), (900.0,))
            for back in range(5, 0, -1)
            for name in TAGS
        )


def learnt(source: Any, monkeypatch: pytest.MonkeyPatch) -> dict[str, int]:
    """For how long a judge says that readings hold, who has learnt of that past."""
    monkeypatch.setattr(recent_scans, "RETRY_S", 0.0)
    judge = Judge(SENSORS, by_light)
    judge.see(FIRST)
    asyncio.run(learn_recent(source, judge, FIRST))
    judge.see(FIRST)
    return judge.holds_ns()


def test_it_waits_until_the_past_can_be_told(monkeypatch: pytest.MonkeyPatch) -> None:
    source = Hesitant(TwinUnavailableError("it starts"), NotRemembered("later", is_lasting=False))
    assert learnt(source, monkeypatch) == dict.fromkeys(TAGS, 3 * HOUR_NS)
    assert source.asked == [RecentRequest(NOW_NS)] * 3


@pytest.mark.parametrize(
    ("error", "level"),
    [
        (NotRemembered("no journal", is_lasting=True), logging.INFO),
        (ZeroDivisionError("a fault"), logging.ERROR),
    ],
)
def test_a_past_that_will_not_be_told_is_no_more_than_a_line_in_the_log(
    error: Exception,
    level: int,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    caplog.set_level(logging.INFO, recent_scans.__name__)
    assert learnt(Hesitant(error), monkeypatch) == dict.fromkeys(TAGS, LONGEST_NS)
    assert [
        record.levelno for record in caplog.records if record.name == recent_scans.__name__
    ] == [level]
