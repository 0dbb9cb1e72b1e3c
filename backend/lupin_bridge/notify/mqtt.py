"""MQTT: publishes the state of the greenhouse to a broker by `aiomqtt`, with a last will.

Only the daily report and the bridge's own `online` are retained; the last will turns that into
`offline`. A retained reading or verdict would outlive its truth. A later subscriber gets everything
at Home Assistant's birth message, or with the next change. The bridge receives only that message:
anybody may publish it, so its effects are rate-limited, and the broker is told to send nothing
large.
"""

from __future__ import annotations

import asyncio
import hashlib
import heapq
import logging
import math
import secrets
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from itertools import chain, islice
from typing import Any, Final

import orjson
from aiomqtt import Client, MqttError, ProtocolVersion, Will
from paho.mqtt.packettypes import PacketTypes
from paho.mqtt.properties import Properties

from lupin_bridge.alarms.board import MAX_WORST, worst_first
from lupin_bridge.judge.episodes import SITE
from lupin_bridge.judge.quantities import Sensors
from lupin_bridge.judge.scans import SHORTEST_NS
from lupin_bridge.judge.verdict import Health, Verdict, derive
from lupin_bridge.notify.destinations import MqttTarget
from lupin_bridge.notify.messages import (
    Backoff,
    Condition,
    GreenhouseState,
    Source,
    Topics,
    alarms_payload,
    greenhouse_configs,
    greenhouse_payload,
    health_payload,
    holds,
    reading_payload,
    tag_configs,
    twin_payload,
)
from lupin_twin.core.state import TagState

log = logging.getLogger(__name__)

_NEVER: Final = 2**63 - 1
_UNKNOWN: Final = Health(Verdict.UNKNOWN)
# Topic and payload.
Message = tuple[str, bytes]
# An empty announcement removes the entity from Home Assistant.
_GONE: Final = b""


@dataclass(slots=True)
class _Published:
    """What was published of a tag or the greenhouse: a digest for each topic."""

    digests: dict[str, bytes] = field(default_factory=dict)
    # What its messages were made of; and the topics of its announcements.
    made_of: object = None
    configs: frozenset[str] = frozenset()
    # When the first of its readings becomes too old.
    until_ns: int = _NEVER


class Mirror:
    """Knows what a broker has, and what it needs next: the newest of each topic."""

    def __init__(self, topics: Topics, sensors: Sensors) -> None:
        self._topics = topics
        self._sensors = sensors
        self._seen = GreenhouseState()
        self._tags: dict[str, TagState] = {}
        self._published: dict[str, _Published] = {}

    def forget(self) -> None:
        """Publish everything again: the broker knows nothing any more."""
        self._published = {
            tag_id: _Published(configs=published.configs)
            for tag_id, published in self._published.items()
        }

    def see(self, seen: GreenhouseState) -> None:
        """Take the current state."""
        if seen.tags is not self._seen.tags:
            self._tags = {tag.tag_id: tag for tag in seen.tags}
        self._seen = seen

    def messages(self) -> Iterator[Message]:
        """Yield what has changed; a tag is written as it is known at its turn."""
        yield from self._changed(SITE, self._of_greenhouse(), None)
        for tag_id in tuple(self._tags):
            tag = self._tags.get(tag_id)
            if tag is not None and self._has_changed(tag):
                yield from self._changed(tag_id, self._of_tag(tag), tag)
        for tag_id in self._published.keys() - self._tags.keys() - {SITE}:
            gone = self._published.pop(tag_id)
            yield from ((topic, _GONE) for topic in sorted(gone.configs))

    def _has_changed(self, tag: TagState) -> bool:
        seen, tag_id = self._seen, tag.tag_id
        published = self._published.setdefault(tag_id, _Published())
        before = published.made_of
        published.made_of = (
            *(tag, seen.judged.tags.get(tag_id), seen.board.by_tag.get(tag_id)),
            *(seen.knows_alarms, seen.origin, seen.now_ns is None, self._holds_ns(tag_id)),
        )
        return published.made_of != before or (seen.now_ns or 0) > published.until_ns

    def _changed(
        self, key: str, said: Iterable[tuple[str, dict[str, Any]]], tag: TagState | None
    ) -> Iterator[Message]:
        published = self._published.setdefault(key, _Published())
        # With the data's origin, so that nobody is called for a simulation.
        states = ((topic, {**it, "origin": self._seen.origin}) for topic, it in said)
        configs = self._announced(tag)
        published.configs = frozenset(configs)
        for topic, payload in chain(configs.items(), states):
            text = orjson.dumps(payload)
            digest = hashlib.blake2b(text, digest_size=16).digest()
            if published.digests.get(topic) != digest:
                published.digests[topic] = digest
                yield topic, text

    def _of_greenhouse(self) -> Iterator[tuple[str, dict[str, Any]]]:
        seen, topics, board = self._seen, self._topics, self._seen.board
        yield topics.twin, twin_payload(seen.status)
        yield topics.of(None, "health"), greenhouse_payload(seen.judged)
        alarms = alarms_payload(len(board.active), board.worst, is_known=seen.knows_alarms)
        yield topics.of(None, "alarms"), alarms

    def _of_tag(self, tag: TagState) -> Iterator[tuple[str, dict[str, Any]]]:
        seen, topics, tag_id = self._seen, self._topics, tag.tag_id
        readings, holds_ns = (*tag.readings, *derive(tag.readings)), self._holds_ns(tag_id)
        self._published[tag_id].until_ns = min(
            (
                reading.observed_at_ns + holds_ns
                for reading in readings
                if reading.observed_at_ns is not None and holds(reading, holds_ns, seen.now_ns)
            ),
            default=_NEVER,
        )
        for reading in readings:
            sensor = self._sensors.named(reading.name)
            payload = reading_payload(reading, sensor, holds_ns, seen.now_ns)
            yield topics.reading(tag_id, reading.name), payload
        yield topics.of(tag_id, "health"), health_payload(seen.judged.tags.get(tag_id, _UNKNOWN))
        active = seen.board.by_tag.get(tag_id, ())
        worst = heapq.nsmallest(MAX_WORST, active, key=worst_first)
        alarms = alarms_payload(len(active), worst, is_known=seen.knows_alarms)
        yield topics.of(tag_id, "alarms"), alarms

    def _holds_ns(self, tag_id: str) -> int:
        return self._seen.holds_ns.get(tag_id, SHORTEST_NS)

    def _announced(self, tag: TagState | None) -> dict[str, dict[str, Any]]:
        """The announcements of a tag's entities, or the greenhouse's (None), by their topics."""
        topics = self._topics
        if not topics.discovery:
            return {}
        if tag is None:
            return dict(greenhouse_configs(topics))
        readings = (*tag.readings, *derive(tag.readings))
        sensors = [self._sensors.named(reading.name) for reading in readings]
        return dict(tag_configs(topics, tag.tag_id, sensors, self._holds_ns(tag.tag_id)))


# --- the connection -------------------------------------------------------------------------------

FIRST_WAIT_S: Final = 1.0
MOST_WAIT_S: Final = 60.0
# After this long without an answer, the broker is connected anew.
ANSWER_S: Final = 10.0
KEEPALIVE_S: Final = 15
POLL_S: Final = 1.0
# Messages without acknowledgement, and messages a second, at most. The first publication of ten
# thousand tags (18 messages each) takes some minutes, and does not block the loop.
WINDOW: Final = 32
MAX_PER_S: Final = 1_000.0
# Interval of repeating `online`: the last will of an earlier process may come late.
STATUS_S: Final = 10.0
# Everything is published again at most this often, however many birth messages come.
REPEAT_S: Final = 5.0
# Limit of a broker's packets: a birth message has some forty bytes, an acknowledgement fewer.
MAX_PACKET_BYTES: Final = 8_192
# Time to publish `offline`: Ctrl-C ends within 2 s, with or without a broker.
LAST_MESSAGE_S: Final = 0.5
ONLINE, OFFLINE = b"online", b"offline"
AT_LEAST_ONCE: Final = 1


class Mqtt:
    """Publishes to a broker, and reconnects. Belongs to the event loop."""

    name: Final = "mqtt"

    def __init__(self, target: MqttTarget, mirror: Mirror) -> None:
        # `waiting` is 0 when the broker has the current state.
        self.condition = Condition(waiting=1)
        self._target, self._topics = target, target.topics
        self._mirror = mirror
        self._backoff = Backoff(FIRST_WAIT_S, MOST_WAIT_S)
        # Unique: two bridges with the same identifier would disconnect each other for ever.
        self._identifier = f"lupin-twin-{secrets.token_hex(6)}"
        self._has_to_repeat: bool
        self._connected: Client | None = None
        self._task: asyncio.Task[None] | None = None
        self._is_stopping = self._is_connecting = False
        self._seen_s = 0.0
        self._look: Callable[[], GreenhouseState] = GreenhouseState

    def start(self, source: Source) -> None:
        """Publish from now on."""
        self._look = source.seen
        self._task = asyncio.create_task(self._run(), name="mqtt")

    async def deliver(self, report_id: str, report: orjson.Fragment) -> bool:
        """Send a report as soon as there is a connection; True: it was taken.

        Raises:
            MqttError: it was not.

        """
        while self._connected is None:
            await asyncio.sleep(POLL_S)
        payload = {"id": report_id, "report": report, "origin": self._look().origin}
        topic, text = self._topics.of(None, "report"), orjson.dumps(payload)
        await self._connected.publish(topic, text, qos=AT_LEAST_ONCE, retain=True)
        self.condition.taken()
        return True

    async def stop(self) -> None:
        """Publish `offline` if the broker is connected, and end."""
        self._is_stopping = True
        if self._task is None:
            return
        if self._is_connecting:
            # If cancelled while it connects, the library logs an error about the broker's answer.
            await asyncio.wait([self._task], timeout=LAST_MESSAGE_S)
        self._task.cancel()
        await asyncio.wait([self._task], timeout=2 * LAST_MESSAGE_S)

    async def _run(self) -> None:
        while True:
            try:
                await self._one_connection()
            except MqttError as error:
                self._failed(str(error))
            except Exception as error:
                log.exception("MQTT had an error and continues")
                self._failed(type(error).__name__)
            self._is_connecting = False
            if self._is_stopping:
                return
            await asyncio.sleep(self._backoff.wait_s())

    async def _one_connection(self) -> None:
        """Connect, and publish until the connection ends, with an `MqttError`."""
        self._is_connecting = True
        async with self._client() as client:
            self._is_connecting = False
            if self._is_stopping:
                return
            try:
                self._connected = client
                await self._serve(client)
            except asyncio.CancelledError:
                await self._announce_shutdown(client)
                raise
            finally:
                self._connected = None

    async def _serve(self, client: Client) -> None:
        topics = self._topics
        if topics.discovery:
            await client.subscribe(topics.birth, AT_LEAST_ONCE)
        await self._publish_online(client)
        if not self.condition.is_connected:
            log.info("MQTT: connected to %s", self._target.called)
        self.condition.taken()
        self._has_to_repeat = True
        try:
            async with asyncio.TaskGroup() as together:
                together.create_task(self._receive(client))
                together.create_task(self._stay_online(client))
                together.create_task(self._publish(client))
        except ExceptionGroup as group:
            raise group.exceptions[0] from None

    async def _receive(self, client: Client) -> None:
        async for message in client.messages:
            if message.payload == ONLINE:
                self._has_to_repeat = True

    async def _stay_online(self, client: Client) -> None:
        while True:
            await asyncio.sleep(STATUS_S)
            await self._publish_online(client)

    async def _publish_online(self, client: Client) -> None:
        await client.publish(self._topics.status, ONLINE, qos=AT_LEAST_ONCE, retain=True)

    async def _publish(self, client: Client) -> None:
        repeated_s = -math.inf
        while True:
            if self._has_to_repeat and time.monotonic() - repeated_s >= REPEAT_S:
                self._has_to_repeat, repeated_s = False, time.monotonic()
                self._mirror.forget()
            self._see()
            messages = self._mirror.messages()
            while batch := list(islice(messages, WINDOW)):
                if time.monotonic() - self._seen_s >= POLL_S:
                    self._see()
                self.condition.waiting = len(batch)
                await asyncio.gather(
                    *(client.publish(topic, text, qos=AT_LEAST_ONCE) for topic, text in batch)
                )
                self.condition.taken(len(batch))
                await asyncio.sleep(len(batch) / MAX_PER_S)
            self._backoff.succeeded()
            self.condition.waiting = 0
            await asyncio.sleep(POLL_S)

    async def _announce_shutdown(self, client: Client) -> None:
        client.timeout = LAST_MESSAGE_S
        try:
            async with asyncio.timeout(LAST_MESSAGE_S):
                await client.publish(self._topics.status, OFFLINE, qos=AT_LEAST_ONCE, retain=True)
        except (MqttError, TimeoutError):
            log.info("MQTT: %s did not accept the shutdown: last will", self._target.called)

    def _client(self) -> Client:
        target = self._target
        # The broker does not send larger packets (MQTT 5, 3.1.2.11.4).
        limits = Properties(PacketTypes.CONNECT)  # type: ignore[no-untyped-call]
        limits.MaximumPacketSize = MAX_PACKET_BYTES
        client = Client(
            target.host,
            target.port,
            identifier=self._identifier,
            protocol=ProtocolVersion.V5,
            properties=limits,
            username=target.user,
            password=target.password,
            tls_context=target.tls,
            will=Will(self._topics.status, OFFLINE, qos=AT_LEAST_ONCE, retain=True),
            timeout=ANSWER_S,
            keepalive=KEEPALIVE_S,
            max_queued_incoming_messages=WINDOW,
        )
        client.pending_calls_threshold = 2 * WINDOW
        # Retrieve the exception: nobody else may do so, and asyncio would log that.
        client._disconnected.add_done_callback(  # noqa: SLF001
            lambda end: end.cancelled() or end.exception()
        )
        return client

    def _see(self) -> None:
        self._seen_s = time.monotonic()
        self._mirror.see(self._look())

    def _failed(self, why: str) -> None:
        before, self.condition.waiting = self.condition.detail, 1
        self.condition.failing(f"{why} ({self._target.called})")
        problem = self.condition.detail
        if problem != before:
            log.warning("MQTT: %s; it will be retried", problem)
