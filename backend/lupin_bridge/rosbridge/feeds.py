"""Topics that come off the wire of ROS, on their way to rosbridge clients.

What a client gets is written once for all who want it, by a worker: a map of
millions of cells takes tenths of a second. Of what waits for a client, the topic's depth is kept:
the newest map, the newest 50 observations; of one that is throttled the newest alone. Nor is it
more than the topic's bytes: what waits for one client may be older than what waits for the others.
"""

from __future__ import annotations

import asyncio
import logging
from collections import OrderedDict
from collections.abc import Awaitable, Callable
from dataclasses import replace
from typing import Final

from lupin_bridge.rosbridge import protocol
from lupin_bridge.rosbridge.session import Feed
from lupin_bridge.rosbridge.values import json_of
from lupin_bridge.serving.client_messages import shown
from lupin_bridge.stream.frames import text_frame
from lupin_bridge.twin.relay import Bounded, NotRelayedError, Relay, Sample
from lupin_bridge.twin.shared import Shared
from lupin_bridge.twin.source import TwinUnavailableError
from lupin_twin.workers import Workers

# The largest message that is told, bytes of CDR, as to viewers: twice as much in JSON, and more.
MAX_MESSAGE_BYTES: Final = 24_000_000
# What is kept of frames for who wants the same one a little later, bytes.
MAX_KEPT: Final = 32_000_000
# What writing takes, roughly and at worst, s a byte of CDR.
_WRITE_S: Final = 1e-7

log = logging.getLogger(__name__)


class Writer:
    """Samples as frames; belongs to the event loop, and one to all clients."""

    def __init__(self, relay: Relay, workers: Workers) -> None:
        self.relay = relay
        self._workers = workers
        self._writing: Shared[bytes] = Shared()
        # The sample is kept as well: its id is the key.
        self._kept: OrderedDict[tuple[str, int], tuple[Sample, bytes]] = OrderedDict()
        self._kept_bytes = 0

    async def frame(self, feed: Feed, sample: Sample) -> bytes:
        """The sample as that feed's client reads it.

        Raises:
            ValueError: it is none of its type, or too large.

        """
        key = (feed.name, id(sample))
        kept = self._kept.get(key)
        if kept is not None:
            return kept[1]
        return await self._writing.get(key, lambda: self._write(key, feed, sample))

    async def _write(self, key: tuple[str, int], feed: Feed, sample: Sample) -> bytes:
        frame = await asyncio.wrap_future(
            self._workers.submit(
                lambda _: _written(self.relay, feed, sample), len(sample.data) * _WRITE_S
            )
        )
        self._kept[key] = (sample, frame)
        self._kept_bytes += len(frame)
        while self._kept_bytes > MAX_KEPT:
            _, (_, oldest) = self._kept.popitem(last=False)
            self._kept_bytes -= len(oldest)
        return frame


def _written(relay: Relay, feed: Feed, sample: Sample) -> bytes:
    message = relay.read(feed.topic, sample)
    try:
        return text_frame(protocol.publish(feed.name, json_of(message)))
    except TypeError as error:
        raise ValueError(str(error)) from error


class Feeding:
    """One client's feeds: each is a task that waits for the client and never for another."""

    def __init__(self, writer: Writer, send: Callable[[bytes], Awaitable[None]]) -> None:
        self._writer = writer
        self._send = send
        self._tasks: dict[str, tuple[Feed, asyncio.Task[None]]] = {}
        # Said once of each topic: who publishes nonsense must not fill the log.
        self._logged: set[tuple[str, bool]] = set()

    def follow(self, feeds: dict[str, Feed], renewed: str | None) -> None:
        """Have these, by their spelling, and no others; one that is `renewed` begins anew."""
        for name, (feed, task) in list(self._tasks.items()):
            if feeds.get(name) != feed or name == renewed:
                task.cancel()
                del self._tasks[name]
        for name, feed in feeds.items():
            if name not in self._tasks:
                task = asyncio.create_task(self._feed(feed), name=f"rosbridge {name}")
                self._tasks[name] = (feed, task)

    def close(self) -> None:
        """End all of them."""
        self.follow({}, None)

    async def _feed(self, feed: Feed) -> None:
        waiting = Bounded(replace(feed.topic, depth=1) if feed.min_interval_s else feed.topic)
        has_come = asyncio.Event()

        def take(sample: Sample) -> None:
            waiting.put(sample)
            has_come.set()

        try:
            listening = await self._writer.relay.listen(feed.topic, take)
        except (NotRelayedError, TwinUnavailableError) as error:
            await self._complain(feed, str(error))
            return
        try:
            while True:
                await has_come.wait()
                has_come.clear()
                while waiting:
                    await self._tell(feed, waiting.take())
                    if feed.min_interval_s:
                        await asyncio.sleep(feed.min_interval_s)
        finally:
            listening.close()

    async def _tell(self, feed: Feed, sample: Sample) -> None:
        if len(sample.data) > MAX_MESSAGE_BYTES:
            await self._complain(
                feed,
                f"a message of topic {shown(feed.name)} is left out: it has {len(sample.data)} "
                f"bytes, the limit is {MAX_MESSAGE_BYTES}",
            )
            return
        try:
            frame = await self._writer.frame(feed, sample)
        except ValueError as error:
            await self._complain(feed, f"a message of topic {shown(feed.name)} is none: {error}")
        except Exception as error:  # noqa: BLE001  # nobody waits for this task: the next one comes
            await self._complain(feed, "the bridge met an error of its own, see its log", error)
        else:
            await self._send(frame)

    async def _complain(self, feed: Feed, text: str, unforeseen: Exception | None = None) -> None:
        said = feed.name, unforeseen is None
        if said not in self._logged:
            self._logged.add(said)
            log.warning("rosbridge, %s: %s", feed.topic.name, text, exc_info=unforeseen)
        await self._send(text_frame(protocol.status("error", text)))
