"""What is published: with its own time, and nothing that changes while nothing happens."""

import math

import pytest

from lupin_bridge.notify import messages
from lupin_twin.core.state import Reading
from tests.support.seen import HOLDS_NS, NOW_NS, SENSORS, S

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
