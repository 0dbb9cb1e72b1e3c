"""What is sent to a broker: changes, once, in their latest form."""

import json
import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lupin_bridge.alarms.board import Board
from lupin_bridge.judge.verdict import Health, Verdict
from lupin_bridge.notify.messages import GreenhouseState, Topics, reading_payload
from lupin_bridge.notify.mqtt import Mirror
from lupin_twin.core.state import Reading
from tests.support.seen import HOLDS_NS, NOW_NS, SENSORS, S, alarm, seen, tag


def mirror(discovery: str = "homeassistant") -> Mirror:
    return Mirror(Topics("lt", discovery), SENSORS)


def reported(mirror: Mirror, now: GreenhouseState) -> dict[str, Any]:
    """What is sent about the greenhouse as it is now: topic to payload, None to remove."""
    mirror.see(now)
    messages = list(mirror.messages())
    found = {topic: json.loads(text) if text else None for topic, text in messages}
    assert len(found) == len(messages), "a topic twice in one turn"
    return found


def announcements(found: Mapping[str, Any]) -> set[str]:
    return {topic for topic in found if topic.startswith("homeassistant/")}


def test_everything_is_sent_once_and_then_only_changes() -> None:
    one = mirror()
    a, b = tag("a", temperature=21.0, humidity=60.0), tag("b", temperature=22.0)
    first = reported(one, seen(a, b))
    assert first["lt/tags/a/readings/temperature"]["value"] == 21.0
    assert first["lt/tags/b/health"]["verdict"] == "healthy"
    assert first["lt/house/health"]["verdict"] == "healthy"
    # Derived from temperature and humidity, judged, and sent like a sensor.
    assert first["lt/tags/a/readings/vpd"]["unit"] == "kPa"
    # For a: five readings, verdict, alarm. For b: one, and these two. For the greenhouse: three.
    assert len(announcements(first)) == 7 + 3 + 3
    assert reported(one, seen(a, b)) == {}
    later = tag("b", NOW_NS + 60 * S, temperature=6.0)
    news = reported(one, seen(a, later, now_ns=NOW_NS + 60 * S))
    assert set(news) == {"lt/tags/b/readings/temperature", "lt/tags/b/health", "lt/house/health"}
    assert news["lt/tags/b/health"]["verdict"] == "critical"


def test_an_expired_reading_is_sent_as_unknown_also_that_of_a_silent_twin() -> None:
    state = tag("a", temperature=21.0)
    now, reading = seen(state), "lt/tags/a/readings/temperature"
    one, silent = mirror(), mirror()
    for each in (one, silent):
        reported(each, now)
    assert reported(one, seen(state, now_ns=NOW_NS + HOLDS_NS)) == {}
    news = reported(one, seen(state, now_ns=NOW_NS + HOLDS_NS + 1))
    assert (news[reading]["value"], news[reading]["stamp"]["sec"]) == (None, NOW_NS // S)
    assert news["lt/tags/a/health"]["verdict"] == "unknown"
    stale = replace(now.status, reason="stale")
    news = reported(silent, replace(now, status=stale, now_ns=NOW_NS + HOLDS_NS + 1))
    assert (news["lt/house/twin"]["state"], news[reading]["value"]) == ("OFF", None)
    # Nor is anything known while the clock does not run.
    assert reported(one, now)[reading]["value"] == 21.0
    assert reported(one, seen(state, now_ns=None))[reading]["value"] is None


def test_only_the_verdict_that_changes_by_itself_is_sent() -> None:
    one = mirror()
    day = seen(tag("a", temperature=16.0), tag("b", temperature=20.0))
    reported(one, day)
    tags = {**day.judged.tags, "a": Health(Verdict.HEALTHY)}
    news = reported(one, replace(day, judged=replace(day.judged, tags=tags)))
    assert set(news) == {"lt/tags/a/health"}
    assert news["lt/tags/a/health"]["verdict"] == "healthy"


def test_each_message_names_its_source_and_a_new_source_sends_all_again() -> None:
    one = mirror()
    state = tag("a", temperature=6.0)
    then = seen(state, alarms=(alarm("a"),))
    first = reported(one, then)
    message = {topic for topic in first if topic.startswith("lt/")}
    assert {first[topic]["origin"] for topic in message} == {"robot"}
    news = reported(one, seen(state, alarms=(alarm("a"),), origin="recorded"))
    assert {topic: it["origin"] for topic, it in news.items()} == dict.fromkeys(message, "recorded")


def test_alarms_are_sent_for_the_tag_and_for_the_greenhouse() -> None:
    one = mirror()
    state = tag("a", temperature=21.0)
    starting = replace(seen(state), board=Board())
    first = reported(one, starting)
    assert first["lt/tags/a/alarms"]["state"] is None
    assert first["lt/house/alarms"]["state"] is None
    known = reported(one, replace(starting, board=seen(state).board))
    assert {topic: payload["state"] for topic, payload in known.items()} == {
        "lt/tags/a/alarms": "OFF",
        "lt/house/alarms": "OFF",
    }
    news = reported(one, seen(state, alarms=(alarm("a"), alarm("", Verdict.UNKNOWN))))
    assert news["lt/tags/a/alarms"]["state"] == "ON"
    assert news["lt/tags/a/alarms"]["alarms"][0]["worst"] == 6.6
    assert news["lt/house/alarms"]["count"] == 2
    news = reported(one, seen(state, alarms=(alarm("a", cleared_ns=NOW_NS),)))
    assert (news["lt/tags/a/alarms"]["state"], news["lt/house/alarms"]["state"]) == ("OFF", "OFF")


def test_an_announcement_that_changes_is_sent_again_and_without_a_prefix_there_is_none() -> None:
    one = mirror()
    state = tag("a", temperature=21.0)
    assert announcements(reported(mirror(""), seen(state))) == set()
    reported(one, seen(state))
    slower = tag("a", NOW_NS + 1, temperature=21.0)
    assert announcements(reported(one, seen(slower, now_ns=NOW_NS + 1))) == set()
    holds = {"a": HOLDS_NS + 1}
    news = reported(one, seen(tag("a", NOW_NS + 2, temperature=21.0), holds_ns=holds))
    (config,) = announcements(news)
    assert news[config]["expire_after"] == 900
    more = reported(one, seen(tag("a", NOW_NS + 2, temperature=21.0, co2=500.0), holds_ns=holds))
    assert announcements(more) == {"homeassistant/sensor/lt/tag_a_-_reading_co2/config"}


def test_a_change_during_a_send_is_sent_in_its_latest_form() -> None:
    one = mirror()
    one.see(seen(tag("a", temperature=1.0), tag("b", temperature=1.0)))
    messages = one.messages()
    first, _ = next(messages)
    assert "house" in first
    one.see(seen(tag("a", temperature=1.0), tag("b", NOW_NS, temperature=2.0)))
    values = [
        json.loads(text)["value"]
        for topic, text in messages
        if topic == "lt/tags/b/readings/temperature"
    ]
    assert values == [2.0]


VALUES = st.sampled_from([None, 5.0, 20.0, 40.0])
GREENHOUSES = st.lists(st.tuples(VALUES, VALUES, st.booleans()), min_size=1, max_size=6)


@given(GREENHOUSES, st.sets(st.integers(0, 5)))
def test_in_any_order_the_broker_ends_up_with_the_latest_state(
    greenhouses: list[tuple[float | None, float | None, bool]], cuts: set[int]
) -> None:
    """Whatever it received before, and however often the connection was lost."""
    one, knows = mirror(), dict[str, Any]()
    for number, (first, second, has_alarm) in enumerate(greenhouses):
        at_ns = NOW_NS + number * S
        tags = [
            tag(name, at_ns, temperature=value)
            for name, value in (("a", first), ("b", second))
            if value is not None
        ]
        now = seen(*tags, alarms=(alarm("a"),) if has_alarm else (), now_ns=at_ns)
        if number in cuts:
            one.forget()
        knows |= reported(one, now)
    fresh = reported(mirror(), now)
    assert {topic: payload for topic, payload in knows.items() if topic in fresh} == fresh
    rest = {topic for topic in knows if topic not in fresh and knows[topic] is not None}
    assert not {topic for topic in rest if topic.startswith("homeassistant/")}


@pytest.mark.parametrize(
    ("reading", "now_ns", "value"),
    [
        (Reading("temperature", 21.5, NOW_NS - HOLDS_NS), NOW_NS, 21.5),
        (Reading("temperature", 21.5, NOW_NS - HOLDS_NS - 1), NOW_NS, None),
        (Reading("temperature", 21.5, NOW_NS + S), NOW_NS, 21.5),
        (Reading("temperature", 21.5, None), NOW_NS, None),
        (Reading("temperature", math.nan, NOW_NS), NOW_NS, None),
        (Reading("temperature", math.inf, NOW_NS), NOW_NS, None),
    ],
)
def test_failed_and_expired_values_are_unknown(
    reading: Reading, now_ns: int | None, value: float | None
) -> None:
    sensor = SENSORS.named("temperature")
    assert reading_payload(reading, sensor, HOLDS_NS, now_ns)["value"] == value
