"""What is published: with its own time, and nothing that changes while nothing happens."""

from __future__ import annotations

import math

import pytest

from lupin_bridge.notify import messages
from lupin_twin.core.state import Reading
from tests.support.seen import HOLDS_NS, NOW_NS, SENSORS, S, alarm, seen, tag

TEMPERATURE = SENSORS.named("temperature")


def test_a_reading_has_its_own_time_and_unit() -> None:
    reading = Reading("temperature", 21.5, NOW_NS - 60 * S)
    assert messages.reading_payload(reading, TEMPERATURE, HOLDS_NS, NOW_NS) == {
        "value": 21.5,
        "unit": "°C",
        "observed_at": "2026-11-21T14:14:00.000000000Z",
        "stamp": {"sec": 1_795_270_440, "nanosec": 0},
        "sensor": "temperature",
    }


@pytest.mark.parametrize(
    ("reading", "now_ns", "value"),
    [
        (Reading("temperature", 21.5, NOW_NS - HOLDS_NS), NOW_NS, 21.5),
        (Reading("temperature", 21.5, NOW_NS - HOLDS_NS - 1), NOW_NS, None),
        (Reading("temperature", 21.5, NOW_NS + S), NOW_NS, 21.5),
        (Reading("temperature", 21.5, NOW_NS), None, None),
        (Reading("temperature", 21.5, None), NOW_NS, None),
        (Reading("temperature", math.nan, NOW_NS), NOW_NS, None),
        (Reading("temperature", math.inf, NOW_NS), NOW_NS, None),
    ],
)
def test_what_failed_or_does_not_hold_any_more_is_not_known(
    reading: Reading, now_ns: int | None, value: float | None
) -> None:
    assert messages.reading_payload(reading, TEMPERATURE, HOLDS_NS, now_ns)["value"] == value


def test_a_verdict_is_as_the_web_contract_has_it() -> None:
    health = seen(tag("a", temperature=6.6)).judged.tags["a"]
    told = messages.health_payload(health)
    assert told["verdict"] == "critical"
    assert told["reasons"][0]["kind"] == "range"
    assert told["reasons"][0]["limit"] == 10


def test_the_house_says_whether_it_is_day() -> None:
    told = messages.greenhouse_payload(seen(tag("a", temperature=20.0)).judged)
    assert told["day"] == {"is_day": True, "source": "assumed"}
    assert told["verdict"] == "healthy"


def test_alarms_are_told_and_the_rest_is_counted() -> None:
    told = messages.alarms_payload(7, [alarm("a"), alarm("b")], is_known=True)
    assert (told["state"], told["count"]) == ("ON", 7)
    assert [it["tag_id"] for it in told["alarms"]] == ["a", "b"]


def test_that_there_is_no_alarm_is_said_only_where_it_is_known() -> None:
    assert messages.alarms_payload(0, [], is_known=True)["state"] == "OFF"
    assert messages.alarms_payload(0, [], is_known=False)["state"] is None
