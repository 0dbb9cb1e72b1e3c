"""What the judge learns of the time before the first state, and of a past that cannot be told."""

from __future__ import annotations

import asyncio
import logging
from typing import Any

import pytest

from lupin_bridge.judge.daylight import Day
from lupin_bridge.judge.judging import Judge
from lupin_bridge.past import rhythms
from lupin_bridge.past.rhythms import REACH_NS, learn_rhythms
from lupin_bridge.twin.source import TwinUnavailableError
from lupin_twin.past import Event, NotRemembered, SeriesPast, SeriesRequest
from lupin_twin.state import Snapshot
from tests.support.past import MadeUp
from tests.support.seen import HOLDS_NS, NOW_NS, SENSORS, S, tag

TAGS = ("a", "b")
HOUR_NS = 3_600 * S
FIRST = Snapshot(NOW_NS, "map", tuple(tag(tag_id, light=900.0) for tag_id in TAGS))


class Hesitant(MadeUp):
    """A past with errors before its first answers."""

    def __init__(self, *errors: Exception) -> None:
        hourly = [(NOW_NS - back * HOUR_NS, 1.0) for back in range(5, 0, -1)]
        super().__init__(NOW_NS, {(tag_id, Event.SCANS): hourly for tag_id in TAGS})
        self.errors = list(errors)

    async def series(self, request: SeriesRequest) -> SeriesPast:
        if self.errors:
            raise self.errors.pop(0)
        return await super().series(request)


def learnt(source: Any, monkeypatch: pytest.MonkeyPatch) -> dict[str, int]:
    """For how long a judge says that readings hold, who has learnt of that past."""
    monkeypatch.setattr(rhythms, "ASK_AGAIN_S", 0.0)
    judge = Judge(SENSORS)

    def see() -> None:
        judge.see(FIRST, lambda _: Day(True, "assumed"))

    see()
    asyncio.run(learn_rhythms(source, judge, FIRST))
    see()
    return judge.holds_ns()


def test_it_waits_until_the_past_can_be_told(monkeypatch: pytest.MonkeyPatch) -> None:
    source = Hesitant(TwinUnavailableError("it starts"), NotRemembered("later", is_lasting=False))
    assert learnt(source, monkeypatch) == dict.fromkeys(TAGS, 3 * HOUR_NS)
    assert {it.start_ns for it in source.asked if isinstance(it, SeriesRequest)} == {
        NOW_NS - REACH_NS
    }


def test_buckets_tell_no_rhythm(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rhythms, "MAX_POINTS", 4)
    assert learnt(Hesitant(), monkeypatch) == dict.fromkeys(TAGS, HOLDS_NS)


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
    caplog.set_level(logging.INFO, rhythms.__name__)
    assert learnt(Hesitant(error), monkeypatch) == dict.fromkeys(TAGS, HOLDS_NS)
    assert [record.levelno for record in caplog.records if record.name == rhythms.__name__] == [
        level
    ]
