"""MQTT: the state of the greenhouse, published to a broker by `aiomqtt`, with a last will.

Nothing is retained but the report of a day, and the bridge's own `online`, which the broker itself
turns into `offline`: a retained reading or verdict would outlive what it says. A later subscriber
gets everything at Home Assistant's birth message, or with the next change. The bridge reads nothing
else: anybody may write to a topic, so what is received is small, and its effects are rate-limited.
"""

from __future__ import annotations

import asyncio
import logging
import math
import secrets
import time
from collections import deque
from collections.abc import Callable
from itertools import islice
from typing import Final

import orjson
from aiomqtt import Client, MqttError, ProtocolVersion, Will
from paho.mqtt.packettypes import PacketTypes
from paho.mqtt.properties import Properties

from lupin_bridge.notify.destinations import MqttTarget
from lupin_bridge.notify.messages import GreenhouseState
from lupin_bridge.notify.mirror import Mirror
from lupin_bridge.notify.sending import Backoff, Condition

log = logging.getLogger(__name__)

FIRST_WAIT_S: Final = 1.0
MOST_WAIT_S: Final = 60.0
# A broker that answers nothing for so long is tried anew.
ANSWER_S: Final = 10.0
KEEPALIVE_S: Final = 15
# How often the state is looked at, s.
POLL_S: Final = 1.0
# Messages without an acknowledgement, and in a second: to publish ten thousand tags for the first
# time (18 messages each) takes some minutes, and does not block the loop.
WINDOW: Final = 32
MAX_PER_S: Final = 1_000.0
# `online` is repeated so often: the will of an earlier process may come late.
STATUS_S: Final = 10.0
# However often a birth message comes, everything is published again so often at most.
REPEAT_S: Final = 5.0
# Of what a broker sends: a birth message has some forty bytes, an acknowledgement fewer.
MAX_PACKET_BYTES: Final = 8_192
# To publish `offline`: Ctrl-C ends within 2 s, broker or not.
LAST_MESSAGE_S: Final = 0.5
ONLINE, OFFLINE = b"online", b"offline"
AT_LEAST_ONCE: Final = 1


class Mqtt:
    """Belongs to the event loop; `look` returns the state of now."""

    name: Final = "mqtt"

    def __init__(
        self,
        target: MqttTarget,
        mirror: Mirror,
        first_wait_s: float = FIRST_WAIT_S,
        answer_s: float = ANSWER_S,
    ) -> None:
        self.condition = Condition()
        self._target, self._topics = target, target.topics
        self._mirror = mirror
        self._backoff = Backoff(first_wait_s, MOST_WAIT_S)
        self._answer_s = answer_s
        # Of its own: two bridges with one name would throw each other out, for ever.
        self._identifier = f"lupin-twin-{secrets.token_hex(6)}"
        self._has_to_repeat: bool
        self._reports: deque[tuple[bytes, asyncio.Future[bool]]] = deque()
        self._task: asyncio.Task[None] | None = None
        self._is_stopping = self._is_connecting = False
        self._seen_s = 0.0
        self._look: Callable[[], GreenhouseState] = GreenhouseState
        # One that was never let in is tried again, and closes what is left of its last try; one
        # that was may hold what the broker had not acknowledged, and is not.
        self._fresh: Client | None = None

    def start(self, look: Callable[[], GreenhouseState]) -> None:
        """Publish from now on."""
        self._look = look
        self._see()
        self._count()
        self._task = asyncio.create_task(self._run(), name="mqtt")

    @property
    def called(self) -> str:
        """The broker and where it publishes there."""
        return f"{self._target.called} {self._topics.prefix}"

    async def deliver(self, report_id: str, report: orjson.Fragment) -> bool:
        """Send a report until it is taken; False: it was given up, which is logged."""
        end: asyncio.Future[bool] = asyncio.get_running_loop().create_future()
        payload = {"id": report_id, "report": report, "origin": self._look().origin}
        self._reports.append((orjson.dumps(payload), end))
        return await end

    async def stop(self) -> None:
        """Publish `offline` if the broker is connected, and end."""
        self._is_stopping = True
        if self._task is None:
            return
        if self._is_connecting:
            # Cut off in the midst of that, the library complains of the broker's answer.
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
                log.exception("MQTT met an error and goes on")
                self._failed(type(error).__name__)
            self._is_connecting = False
            if self._is_stopping:
                return
            await asyncio.sleep(self._backoff.wait_s())

    async def _one_connection(self) -> None:
        """Connect, and publish until the connection ends.

        Raises:
            MqttError: it could not be made, or has ended.

        """
        client = self._fresh = self._fresh or self._client()
        self._is_connecting = True
        async with client:
            self._is_connecting, self._fresh = False, None
            if self._is_stopping:
                return
            try:
                await self._serve(client)
            except asyncio.CancelledError:
                await self._announce_shutdown(client)
                raise

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
        except* MqttError as group:
            raise MqttError(str(group.exceptions[0])) from None

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
            await self._publish_reports(client)
            messages = self._mirror.messages()
            while batch := list(islice(messages, WINDOW)):
                if time.monotonic() - self._seen_s >= POLL_S:
                    self._see()
                self._count(in_flight=1)
                await asyncio.gather(
                    *(client.publish(topic, text, qos=AT_LEAST_ONCE) for topic, text in batch)
                )
                self.condition.taken(len(batch))
                await asyncio.sleep(len(batch) / MAX_PER_S)
            self._backoff.succeeded()
            self._count()
            await asyncio.sleep(POLL_S)

    async def _publish_reports(self, client: Client) -> None:
        topic = self._topics.of(None, "report")
        while self._reports:
            payload, end = self._reports[0]
            await client.publish(topic, payload, qos=AT_LEAST_ONCE, retain=True)
            self._reports.popleft()
            self.condition.taken()
            if not end.done():
                end.set_result(True)

    async def _announce_shutdown(self, client: Client) -> None:
        client.timeout = LAST_MESSAGE_S
        try:
            async with asyncio.timeout(LAST_MESSAGE_S):
                await client.publish(self._topics.status, OFFLINE, qos=AT_LEAST_ONCE, retain=True)
        except (MqttError, TimeoutError):
            log.info("MQTT: %s did not take the shutdown, its will applies", self._target.called)

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
            timeout=self._answer_s,
            keepalive=KEEPALIVE_S,
            max_queued_incoming_messages=WINDOW,
        )
        client.pending_calls_threshold = 2 * WINDOW
        _take_no_more_than(client, MAX_PACKET_BYTES)
        return client

    def _see(self) -> None:
        self._seen_s = time.monotonic()
        self._mirror.see(self._look())

    def _count(self, in_flight: int = 0) -> None:
        self.condition.waiting = self._mirror.waiting + in_flight + len(self._reports)
        self.condition.dropped = self._mirror.dropped

    def _failed(self, why: str) -> None:
        before = self.condition.detail
        self.condition.failing(f"{why} ({self._target.called})")
        problem = self.condition.detail
        if problem != before:
            log.warning("MQTT: %s; it will be retried", problem)
        # So that what changes meanwhile is seen to wait.
        self._see()
        self._count()


def _take_no_more_than(client: Client, most: int) -> None:
    """End the connection at a larger packet before it is read: not every broker heeds the limit.

    paho has no limit, and asks the socket for all that is left of a packet.
    """
    paho = client._client  # noqa: SLF001
    receive = paho._sock_recv  # noqa: SLF001

    def receive_little(count: int) -> bytes:
        if count > most:
            raise OSError(f"the broker sent a packet of {count} bytes, the limit is {most}")
        return receive(count)

    paho._sock_recv = receive_little  # type: ignore[method-assign, assignment]  # noqa: SLF001
