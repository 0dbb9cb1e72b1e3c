"""Every sensor's report is fetched, and changed tags are passed on when they differ."""

import asyncio
import math

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
from lupin_twin.core.past import PastRefused
from lupin_twin.core.state import Pose, Reading, Snapshot, TagState
from lupin_twin.field.engine import FieldRefused
from lupin_twin.runtime.estimates import Report, TagCheck
from tests.support.waiting import until

HERE = Pose(1.0, 2.0, 0.5, 0.0, 0.0, 0.0, 1.0)


def report(at_ns: int, changed: dict[str, int | None]) -> Report:
    tags = tuple(
        TagCheck(tag_id, 1.0, 1, 1.0, 1.0, 0.0, 0.0, since) for tag_id, since in changed.items()
    )
    return Report(at_ns, is_fitted=True, tags=tags)


def snapshot(**latest: int) -> Snapshot:
    tags = [
        TagState(name, pose=HERE, readings=(Reading(name, 1.0, at_ns),))
        for name, at_ns in latest.items()
    ]
    return Snapshot(100, "map", tuple(tags))


def test_estimates_use_finite_readings_of_tags_with_a_position() -> None:
    tags = (
        TagState("a", pose=HERE, readings=(Reading("co2", 1.0, 5), Reading("light", math.nan, 9))),
        TagState("b", pose=HERE, readings=(Reading("co2", 1.0, 7),)),
        TagState("c", readings=(Reading("co2", 1.0, 8),)),
    )
    assert sensors_of(Snapshot(100, "map", tags)) == ["co2"]


def test_changed_tags_are_listed_by_tag_and_sensor() -> None:
    known = {"co2": report(9, {"a": None, "b": 3}), "light": report(9, {"b": 4, "c": 5})}
    assert changed_of(known) == {"b": {"co2": 3, "light": 4}, "c": {"light": 5}}


class Stage:
    """The queries of a poller, and its updates."""

    def __init__(self) -> None:
        self.requested: list[str] = []
        self.reported: list[Changed] = []
        self.snapshot: Snapshot | None = None
        self.answers: dict[str, Report] = {}
        self.error: Exception = TwinUnavailableError("nobody is there")
        self.poller = EstimatePoller(self.report_on, lambda: self.snapshot, self.reported.append)

    async def report_on(self, sensor: str, snapshot: Snapshot) -> Report:
        assert snapshot is self.snapshot
        self.requested.append(sensor)
        if sensor not in self.answers:
            raise self.error
        return self.answers[sensor]


async def test_changes_are_passed_on_in_their_current_form() -> None:
    stage = Stage()
    await stage.poller.update()
    assert stage.requested == [], "there is no state yet"
    stage.snapshot = snapshot(co2=5, light=6)
    stage.answers = {"co2": report(9, {"co2": None}), "light": report(4, {})}
    await stage.poller.update()
    assert stage.requested == ["co2", "light"]
    assert stage.reported == [{}]
    stage.answers["co2"] = report(9, {"co2": 5})
    for _ in range(2):
        await stage.poller.update()
        assert stage.reported[-1] == {"co2": {"co2": 5}}
    stage.snapshot = snapshot(light=6)
    await stage.poller.update()
    assert stage.reported[-1] == {}, "no tag has that sensor any more"


@pytest.mark.parametrize(
    "error",
    [
        TwinUnavailableError("nobody is there"),
        # A clock that went back, and a name that is too long.
        PastRefused("at is 9 s, later than now, 8 s"),
        FieldRefused("sensor_type has 300 characters, the limit is 256"),
    ],
)
async def test_where_a_report_fails_the_last_one_holds(error: Exception) -> None:
    stage = Stage()
    stage.snapshot, stage.error = snapshot(co2=5, light=6), error
    stage.answers = {"co2": report(9, {"co2": 5}), "light": report(9, {})}
    await stage.poller.update()
    stage.answers = {"light": report(9, {"light": 6})}
    await stage.poller.update()
    assert stage.reported[-1] == {"co2": {"co2": 5}, "light": {"light": 6}}


def test_the_number_of_queried_sensors_is_limited() -> None:
    stage = Stage()
    names = [f"s{number:02}" for number in range(MAX_SENSORS + 1)]
    stage.snapshot = snapshot(**dict.fromkeys(names, 1))
    stage.answers = dict.fromkeys(names, report(9, {}))
    asyncio.run(stage.poller.update())
    assert stage.requested == names[:-1]


async def test_a_failed_query_ends_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pollers, "PERIOD_S", 0.0)
    stage = Stage()
    stage.snapshot = snapshot(co2=1)
    stage.poller.start()
    await until(lambda: len(stage.requested) > 1, "another query")
    stage.answers = {"co2": report(9, {"co2": 1})}
    await until(lambda: stage.reported[-1], "the answer")
    await stage.poller.stop()
