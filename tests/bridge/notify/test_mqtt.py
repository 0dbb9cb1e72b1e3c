"""MQTT: what is sent to a broker, and a real mosquitto that is absent, hangs, or is killed."""

import asyncio
import json
import math
from collections.abc import AsyncIterator, Iterator, Mapping
from contextlib import asynccontextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lupin_bridge.alarms.board import Board
from lupin_bridge.judge.verdict import Health, Verdict
from lupin_bridge.notify import mqtt
from lupin_bridge.notify.destinations import Targets
from lupin_bridge.notify.messages import GreenhouseState, Topics, reading_payload
from lupin_bridge.notify.mqtt import Mirror, Mqtt
from lupin_bridge.settings import Secrets, Settings
from lupin_twin.core.state import Reading
from tests.support.mosquitto import PASSWORD, USER, Broker, Subscriber
from tests.support.seen import HOLDS_NS, NOW_NS, SENSORS, S, alarm, damp_air, seen, tag
from tests.support.tls import certificate
from tests.support.waiting import PATIENCE_S, until

READING = "lt/tags/a/readings/temperature"
CONFIG = "homeassistant/sensor/lt/tag_a_-_reading_temperature/config"


class Greenhouse:
    """The state of a greenhouse, as a channel reads it."""

    def __init__(self) -> None:
        self.now = seen(tag("a", temperature=20.0))
        self._number = 0
        self.is_faulty = False

    def seen(self) -> GreenhouseState:
        assert not self.is_faulty
        return self.now

    def scan(self) -> float:
        """Another scan of the tag, a second later; returns its reading."""
        self._number += 1
        value, at_ns = 20.0 + self._number / 100, NOW_NS + self._number * S
        self.now = seen(tag("a", at_ns, temperature=value), now_ns=at_ns)
        return value


@asynccontextmanager
async def telling(
    broker: Broker,
    greenhouse: Greenhouse,
    answer_s: float = PATIENCE_S,
    secrets: Secrets | None = None,
    **settings: Any,
) -> AsyncIterator[Mqtt]:
    """A channel to that broker, with short waits."""
    chosen = Settings(mqtt_url=broker.url, mqtt_prefix="lt", **settings)
    target = Targets.of(chosen, secrets or Secrets()).mqtt
    assert target is not None
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(mqtt, "FIRST_WAIT_S", 0.001)
        patch.setattr(mqtt, "ANSWER_S", answer_s)
        channel = Mqtt(target, Mirror(target.topics, SENSORS))
        channel.start(greenhouse)  # type: ignore[arg-type]  # what it needs of one
        try:
            yield channel
        finally:
            await channel.stop()


async def until_reported(received: Subscriber, value: float) -> None:
    await until(
        lambda: (received.last(READING) or {}).get("value") == value, f"the reading {value}"
    )


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Broker]:
    """A broker for several tests; each leaves only its status behind."""
    broker = Broker(tmp_path_factory.mktemp("mosquitto"))
    with broker.running():
        yield broker


async def test_a_broker_gets_the_state_and_then_its_changes(shared: Broker) -> None:
    greenhouse = Greenhouse()
    greenhouse.now = seen(tag("a", temperature=20.0), alarms=(alarm("a"),))
    with Subscriber(shared) as received:
        async with telling(shared, greenhouse) as channel:
            await until_reported(received, 20.0)
            await until(lambda: received.last("lt/tags/a/alarms"), "the alarm")
            await until_reported(received, greenhouse.scan())
            await until(lambda: channel.condition.waiting == 0, "the rest")
            assert (channel.condition.is_connected, channel.condition.failed) == (True, 0)
        await until(lambda: received.of("lt/status")[-1:] == [b"offline"], "the good-bye")
    assert received.last(READING)["observed_at"] == "2026-11-21T14:15:01.000000000Z"
    assert received.last(CONFIG)["state_topic"] == READING
    assert received.last("lt/tags/a/alarms")["state"] == "OFF"
    assert received.last("lt/house/twin")["state"] == "ON"
    assert received.of("lt/status")[-2:] == [b"online", b"offline"]
    assert {message.qos for message in received.received} == {1}


async def test_only_the_status_is_retained_and_that_of_removed_tags_is_not(shared: Broker) -> None:
    greenhouse = Greenhouse()
    greenhouse.now = seen(tag("a", temperature=20.0), tag("gone", temperature=20.0))
    async with telling(shared, greenhouse) as channel:
        await until(lambda: channel.condition.sent > 14, "all of it")
        await until(lambda: channel.condition.waiting == 0, "all of it")
        with Subscriber(shared) as received:
            greenhouse.now = seen(tag("a", temperature=20.0))
            gone = CONFIG.replace("tag_a_", "tag_gone_")
            await until(lambda: received.of(gone) == [b""], "the end of its entity")
        with Subscriber(shared) as late:
            # Sent in order: whoever has this has all that was retained.
            late.publish("marker", "x")
            await until(lambda: late.of("marker"), "the marker")
            retained = {it.topic: it.payload for it in late.received if it.retain}
            assert retained == {"lt/status": b"online"}


async def test_at_home_assistants_birth_everything_is_sent_again(
    shared: Broker, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mqtt, "REPEAT_S", 0.1)
    async with telling(shared, Greenhouse()) as channel:
        await until(lambda: channel.condition.sent > 1, "the first time")
        await until(lambda: channel.condition.waiting == 0, "the first time")
        with Subscriber(shared) as later:
            later.publish("homeassistant/status", "offline")
            later.publish("homeassistant/status", "online")
            await until_reported(later, 20.0)
            await until(lambda: later.last("lt/tags/a/health"), "the verdict")
            assert later.last(CONFIG)["expire_after"] == 600


async def test_a_flood_of_wills_and_births_is_answered_at_a_limited_rate(
    shared: Broker, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The last process's will, or another one's offline message, may arrive late."""
    for name in ("STATUS_S", "REPEAT_S"):
        monkeypatch.setattr(mqtt, name, 2.0)
    with Subscriber(shared) as received:
        async with telling(shared, Greenhouse()) as channel:
            await until(lambda: channel.condition.sent > 10, "the first time")
            await until(lambda: received.of("lt/status")[-1:] == [b"online"], "that it has come")
            before, sent = len(received.of("lt/status")), channel.condition.sent
            for _ in range(100):
                received.publish("lt/status", "offline", retain=True)
                received.publish("homeassistant/status", "online")
            await until(lambda: received.of("lt/status")[-1:] == [b"online"], "that it is there")
            await until(lambda: channel.condition.sent > sent, "all of it, again")
            wording = received.of("lt/status")[before:]
            assert wording.count(b"offline") == 100
            # The flood took a moment; by the clock there was time for one or two.
            assert wording.count(b"online") <= 3
            assert channel.condition.sent <= 3 * sent


async def test_two_bridges_with_one_prefix_do_not_disconnect_each_other(shared: Broker) -> None:
    async with telling(shared, Greenhouse()) as one, telling(shared, Greenhouse()) as two:
        await until(lambda: one.condition.sent > 10, "what the one tells")
        await until(lambda: two.condition.sent > 10, "what the other tells")
        assert (one.condition.failed, two.condition.failed) == (0, 0)


async def test_a_broker_that_is_absent_appears_and_is_killed_gets_the_latest_state(
    tmp_path: Path,
) -> None:
    broker, greenhouse = Broker(tmp_path), Greenhouse()
    async with telling(broker, greenhouse) as channel:
        await until(lambda: channel.condition.failed > 2, "some attempts")
        assert channel.condition.detail == f"[Errno 111] Connection refused ({broker.url})"
        for _ in range(2):
            with broker.running() as process, Subscriber(broker) as received:
                greenhouse.scan()
                await until_reported(received, greenhouse.scan())
                assert channel.condition.detail == ""
                process.kill()
            await until(lambda: not channel.condition.is_connected, "the end of the broker")
            assert channel.condition.waiting == 1


async def test_after_a_failure_to_read_the_greenhouse_everything_is_sent_again(
    shared: Broker,
) -> None:
    greenhouse = Greenhouse()
    with Subscriber(shared) as received:
        async with telling(shared, greenhouse) as channel:
            await until_reported(received, 20.0)
            greenhouse.is_faulty = True
            await until(lambda: "AssertionError" in channel.condition.detail, "the fault")
            greenhouse.is_faulty = False
            await until_reported(received, greenhouse.scan())


async def test_a_broker_that_hangs_is_reconnected_and_gets_the_latest_state(tmp_path: Path) -> None:
    broker, greenhouse = Broker(tmp_path), Greenhouse()
    with broker.running() as process:
        async with telling(broker, greenhouse, answer_s=0.3) as channel:
            with Subscriber(broker) as received:
                await until_reported(received, 20.0)
            process.freeze()
            greenhouse.scan()
            failed = channel.condition.failed
            # Once while connected, and then without accepting a connection.
            await until(lambda: channel.condition.failed > failed + 2, "some attempts")
            assert not channel.condition.is_connected
            last = greenhouse.scan()
            process.thaw()
            with Subscriber(broker) as received:
                await until_reported(received, last)
                await until(lambda: channel.condition.is_connected, "the connection")


async def test_it_stops_at_once_while_a_broker_hangs(tmp_path: Path) -> None:
    broker = Broker(tmp_path)
    with broker.running() as process:
        async with telling(broker, Greenhouse()) as channel:
            await until(lambda: channel.condition.sent > 10, "the connection")
            process.freeze()
            async with asyncio.timeout(PATIENCE_S / 4):  # its own time-out may be a minute
                await channel.stop()


# After a failed handshake, paho leaves its socket to the garbage collector.
@pytest.mark.filterwarnings("ignore:.*ssl.SSLSocket:pytest.PytestUnraisableExceptionWarning")
async def test_a_password_and_an_authority_satisfy_a_broker_that_needs_them(tmp_path: Path) -> None:
    made = certificate(tmp_path)
    ca = tmp_path / "ca.pem"
    made.authority.cert_pem.write_to_path(str(ca))
    broker = Broker(tmp_path, certificate=made, wants_password=True)
    known, wrong = Secrets(mqtt_password=PASSWORD), Secrets(mqtt_password="wrong")
    given: dict[str, Any] = {"mqtt_user": USER, "mqtt_ca": str(ca)}
    with broker.running():
        async with telling(broker, Greenhouse(), secrets=known, **given) as channel:
            await until(lambda: channel.condition.sent > 10, "all of it")
        async with telling(broker, Greenhouse(), secrets=wrong, **given) as channel:
            await until(lambda: channel.condition.failed > 0, "the refusal")
            assert "Not authorized" in channel.condition.detail
            assert "wrong" not in channel.condition.detail
        async with telling(broker, Greenhouse(), secrets=known, mqtt_user=USER) as channel:
            await until(lambda: channel.condition.failed > 0, "the refusal")
            assert "certificate verify failed" in channel.condition.detail


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


def test_each_message_names_its_source_and_only_a_verdict_that_changes_is_sent() -> None:
    one = mirror()
    state = tag("a", temperature=6.0)
    then = seen(state, alarms=(alarm("a"),))
    first = reported(one, then)
    message = {topic for topic in first if topic.startswith("lt/")}
    assert {first[topic]["origin"] for topic in message} == {"robot"}
    news = reported(one, seen(state, alarms=(alarm("a"),), origin="recorded"))
    assert {topic: it["origin"] for topic, it in news.items()} == dict.fromkeys(message, "recorded")
    one = mirror()
    day = seen(tag("a", temperature=16.0), tag("b", temperature=20.0))
    reported(one, day)
    tags = {**day.judged.tags, "a": Health(Verdict.HEALTHY)}
    news = reported(one, replace(day, judged=replace(day.judged, tags=tags)))
    assert set(news) == {"lt/tags/a/health"}
    assert news["lt/tags/a/health"]["verdict"] == "healthy"


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
    # Damp air is one entry, whatever sensors tell of it.
    (damp,) = reported(one, seen(state, alarms=damp_air("a")))["lt/tags/a/alarms"]["alarms"]
    assert (damp["reason"]["sensor"], len(damp["also"])) == ("vpd", 1)
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
