"""MQTT: the house as it is, told to a broker by `aiomqtt`, with a will for when it is not.

Nothing is retained but the bridge's own `online`, which the broker itself turns into `offline`: a
retained reading or verdict would outlive what it says. Who comes later is told at Home Assistant's
birth message, or with the next change.
"""

from __future__ import annotations

import asyncio
import logging
import random
import secrets
import time
from collections.abc import Callable
from itertools import islice
from typing import Final

from aiomqtt import Client, MqttError, Will

from lupin_bridge.outward.choosing import MqttTarget
from lupin_bridge.outward.condition import Backoff, Condition
from lupin_bridge.outward.mirror import Mirror
from lupin_bridge.outward.payloads import Seen

log = logging.getLogger(__name__)

FIRST_WAIT_S: Final = 1.0
MOST_WAIT_S: Final = 60.0
# A broker that answers nothing for so long is tried anew.
ANSWER_S: Final = 10.0
KEEPALIVE_S: Final = 15
# How often the house is looked at, s.
LOOK_S: Final = 1.0
# Messages that a broker has not acknowledged yet; and a second, so that ten thousand tags, told
# for the first time (18 messages each), take some minutes and not the loop.
WINDOW: Final = 32
MAX_PER_S: Final = 1_000.0
# For the good-bye: Ctrl-C ends within 2 s, broker or not.
GOODBYE_S: Final = 0.5
ONLINE, OFFLINE = b"online", b"offline"
AT_LEAST_ONCE: Final = 1


class Mqtt:
    """Belongs to the event loop; `look` tells how the house is now."""

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
        self._has_to_repeat = True
        self._task: asyncio.Task[None] | None = None
        self._is_stopping = self._is_connecting = False
        self._seen_s = 0.0
        self._look: Callable[[], Seen] = Seen
        # One that was never let in is tried again, and closes what is left of its last try; one
        # that was may hold what the broker had not acknowledged, and is not.
        self._fresh: Client | None = None

    def start(self, look: Callable[[], Seen]) -> None:
        """Tell the broker from now on."""
        self._look = look
        self._see()
        self._count()
        self._task = asyncio.create_task(self._run(), name="mqtt")

    async def stop(self) -> None:
        """Say good-bye if there is somebody to say it to, and end."""
        self._is_stopping = True
        if self._task is None:
            return
        if self._is_connecting:
            # Cut off in the midst of that, the library complains of the broker's answer.
            await asyncio.wait([self._task], timeout=GOODBYE_S)
        self._task.cancel()
        await asyncio.wait([self._task], timeout=2 * GOODBYE_S)

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
            await asyncio.sleep(self._backoff.wait_s(random.random()))  # noqa: S311

    async def _one_connection(self) -> None:
        """Connect, and tell until the connection ends.

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
                await self._say_goodbye(client)
                raise

    async def _serve(self, client: Client) -> None:
        topics = self._topics
        heard = [topics.status, *([topics.birth] if topics.discovery else [])]
        await client.subscribe([(topic, AT_LEAST_ONCE) for topic in heard])
        await client.publish(topics.status, ONLINE, qos=AT_LEAST_ONCE, retain=True)
        if not self.condition.is_connected:
            log.info("MQTT: connected to %s", self._target.called)
        self.condition.taken()
        self._has_to_repeat = True
        try:
            async with asyncio.TaskGroup() as both:
                both.create_task(self._hear(client))
                both.create_task(self._tell(client))
        except* MqttError as group:
            raise MqttError(str(group.exceptions[0])) from None

    async def _hear(self, client: Client) -> None:
        async for message in client.messages:
            topic, said = message.topic.value, message.payload
            if topic == self._topics.birth and said == ONLINE:
                self._has_to_repeat = True
            elif topic == self._topics.status and said != ONLINE:
                # The will of a bridge that was there before, or another one's good-bye.
                await client.publish(topic, ONLINE, qos=AT_LEAST_ONCE, retain=True)

    async def _tell(self, client: Client) -> None:
        while True:
            # However often somebody says that he was born: once a look.
            if self._has_to_repeat:
                self._mirror.forget()
            self._has_to_repeat = False
            self._see()
            messages = self._mirror.messages()
            while batch := list(islice(messages, WINDOW)):
                if time.monotonic() - self._seen_s >= LOOK_S:
                    self._see()
                self._count(in_flight=1)
                await asyncio.gather(
                    *(client.publish(it.topic, it.payload, qos=AT_LEAST_ONCE) for it in batch)
                )
                self.condition.taken(len(batch))
                await asyncio.sleep(len(batch) / MAX_PER_S)
            self._backoff.succeeded()
            self._count()
            await asyncio.sleep(LOOK_S)

    async def _say_goodbye(self, client: Client) -> None:
        client.timeout = GOODBYE_S
        try:
            async with asyncio.timeout(GOODBYE_S):
                await client.publish(self._topics.status, OFFLINE, qos=AT_LEAST_ONCE, retain=True)
        except (MqttError, TimeoutError):
            log.info("MQTT: %s took no good-bye, its will will do", self._target.called)

    def _client(self) -> Client:
        target = self._target
        client = Client(
            target.host,
            target.port,
            identifier=self._identifier,
            username=target.user,
            password=target.password,
            tls_context=target.tls,
            will=Will(self._topics.status, OFFLINE, qos=AT_LEAST_ONCE, retain=True),
            timeout=self._answer_s,
            keepalive=KEEPALIVE_S,
            max_queued_incoming_messages=WINDOW,
        )
        client.pending_calls_threshold = 2 * WINDOW
        return client

    def _see(self) -> None:
        self._seen_s = time.monotonic()
        self._mirror.see(self._look())

    def _count(self, in_flight: int = 0) -> None:
        self.condition.waiting = self._mirror.waiting + in_flight
        self.condition.dropped = self._mirror.given_way

    def _failed(self, why: str) -> None:
        before = self.condition.detail
        self.condition.failing(f"{why} ({self._target.called})")
        said = self.condition.detail
        if said != before:
            log.warning("MQTT: %s; it is tried again", said)
        # So that what changes meanwhile is seen to wait.
        self._see()
        self._count()
