"""Every sensor's report is fetched; tags that have changed are passed on when they are others."""

import asyncio
import math
from typing import Any

import pytest

from lupin_bridge.feed.source import TwinUnavailableError
from lupin_bridge.stream import pollers
from lupin_bridge.stream.pollers import (
    MAX_SENSORS,
    Changed,
    EstimatePoller,
    changed_of,
    sensors_of,
)
from lupin_twin.core.state import Pose, Reading, Snapshot, TagState
from lupin_twin.estimate.engine import Record, Tally
from lupin_twin.runtime.estimates import Report, ReportRequest, TagCheck
from tests.support.waiting import until

HERE = Pose(1.0, 2.0, 0.5, 0.0, 0.0, 0.0, 1.0)


def report(at_ns: int, changed: dict[str, int | None]) -> Report:
    tags = tuple(
        TagCheck(tag_id, 1.0, 1, 1.0, 1.0, 0.0, 0.0, since) for tag_id, since in changed.items()
    )
    return Report(at_ns, 1, "", Record(None, Tally(), Tally()), tags)


def snapshot(**newest: int) -> Snapshot:
    tags = [
        TagState(name, pose=HERE, readings=(Reading(name, 1.0, at_ns),))
        for name, at_ns in newest.items()
    ]
    return Snapshot(100, "map", tuple(tags))


def test_estimates_are_made_of_finite_readings_of_tags_with_a_place() -> None:
    tags = (
        TagState("a", pose=HERE, readings=(Reading("co2", 1.0, 5), Reading("light", math.nan, 9))),
        TagState("b", pose=HERE, readings=(Reading("co2", 1.0, 7),)),
        TagState("c", readings=(Reading("co2", 1.0, 8),)),
    )
    assert sensors_of(Snapshot(100, "map", tags)) == ["co2"]


def test_changed_tags_are_told_by_tag_and_sensor() -> None:
    known = {"co2": report(9, {"a": None, "b": 3}), "light": report(9, {"b": 4, "c": 5})}
    assert changed_of(known) == {"b": {"co2": 3, "light": 4}, "c": {"light": 5}}


class Stage:
    """What a poller asks, and tells."""

    def __init__(self) -> None:
        self.asked: list[str] = []
        self.told: list[Changed] = []
        self.snapshot: Snapshot | None = None
        self.answers: dict[str, Report] = {}
        stage: Any = self
        self.poller = EstimatePoller(stage, lambda: self.snapshot, self.told.append)

    async def estimate_report(self, request: ReportRequest) -> Report:
        self.asked.append(request.sensor_type)
        if request.sensor_type not in self.answers:
            raise TwinUnavailableError("nobody is there")
        return self.answers[request.sensor_type]


async def test_what_has_changed_is_passed_on_as_it_is_now() -> None:
    stage = Stage()
    await stage.poller.update()
    assert stage.asked == [], "there is no state yet"
    stage.snapshot = snapshot(co2=5, light=6)
    stage.answers = {"co2": report(9, {"co2": None}), "light": report(4, {})}
    await stage.poller.update()
    assert stage.asked == ["co2", "light"]
    assert stage.told == [{}]
    stage.answers["co2"] = report(9, {"co2": 5})
    for _ in range(2):
        await stage.poller.update()
        assert stage.told[-1] == {"co2": {"co2": 5}}
    stage.snapshot = snapshot(light=6)
    await stage.poller.update()
    assert stage.told[-1] == {}, "no tag has that sensor any more"


async def test_of_a_sensor_that_cannot_be_reported_just_now_the_last_report_stands() -> None:
    stage = Stage()
    stage.snapshot, stage.answers = snapshot(co2=5), {"co2": report(9, {"co2": 5})}
    await stage.poller.update()
    stage.answers = {}
    await stage.poller.update()
    assert stage.told[-1] == {"co2": {"co2": 5}}


def test_of_many_sensors_so_many_are_asked_after() -> None:
    stage = Stage()
    names = [f"s{number:02}" for number in range(MAX_SENSORS + 1)]
    stage.snapshot = snapshot(**dict.fromkeys(names, 1))
    stage.answers = dict.fromkeys(names, report(9, {}))
    asyncio.run(stage.poller.update())
    assert stage.asked == names[:-1]


async def test_what_cannot_be_answered_ends_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pollers, "PERIOD_S", 0.0)
    stage = Stage()
    stage.snapshot = snapshot(co2=1)
    stage.poller.start()
    await until(lambda: len(stage.asked) > 1, "it to be asked again")
    stage.answers = {"co2": report(9, {"co2": 1})}
    await until(lambda: stage.told[-1], "the answer")
    await stage.poller.stop()
