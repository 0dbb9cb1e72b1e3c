"""The channels that there are: a twin's topics, and the layers that somebody publishes just now.

Looked for while there are clients, once for all of them.
"""

from __future__ import annotations

import asyncio
import logging
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from itertools import count
from typing import Final

from lupin_bridge.foxglove.protocol import Channel
from lupin_bridge.foxglove.session import Counts
from lupin_bridge.message_schemas import schema_text
from lupin_bridge.twin.names import Topic, TwinNames, topics_of
from lupin_bridge.twin.source import TwinSource, TwinUnavailableError

log = logging.getLogger(__name__)

# How often layers are looked for, s.
LOOK_S: Final = 2.0
# How often simulated time is told, s: often enough to look as if it ran.
TICK_S: Final = 0.1
MAX_LAYERS: Final = 64

_POINTS: Final = "sensor_msgs/msg/PointCloud2"
_MARKERS: Final = "visualization_msgs/msg/MarkerArray"


class Offer:
    """What clients may subscribe to; belongs to the event loop.

    `channels`, `wires` (the same as they are advertised) and `topics` go by the channels' ids.
    `tells_time`: time is simulated.
    """

    def __init__(self, source: TwinSource) -> None:
        self.session_id = uuid.uuid4().hex
        self.channels: dict[int, Channel] = {}
        self.wires: dict[int, bytes] = {}
        self.topics: dict[int, Topic] = {}
        self.tells_time = False
        self._told_ns: int | None = None
        self.counts = Counts()
        self._source = source
        self._ids = count(1)
        self._known: dict[Topic, Channel] = {}
        self._missing: set[str] = set()
        self._followers: dict[Callable[[int | None], None], None] = {}
        self._following: list[asyncio.Task[None]] = []
        self._looking: asyncio.Task[None] | None = None

    @contextmanager
    def followed(self, on_news: Callable[[int | None], None]) -> Iterator[None]:
        """Have `on_news` called when channels come or go (None), or time does (ROS time, ns).

        Of time that stands, at once: it has been told to the others, and may never go on.
        """
        self._followers[on_news] = None
        if self._following:
            if self._told_ns is not None:
                on_news(self._told_ns)
        else:
            self._told_ns = None
            self._following = [
                asyncio.create_task(self._keep_looking(), name="foxglove channels"),
                asyncio.create_task(self._keep_telling(), name="foxglove time"),
            ]
        try:
            yield
        finally:
            del self._followers[on_news]
            if not self._followers:
                for task in self._following:
                    task.cancel()
                self._following = []

    async def look(self) -> None:
        """Bring the channels up to date; whoever asks meanwhile gets the same look."""
        if self._looking is None or self._looking.done():
            self._looking = asyncio.create_task(self._look(), name="foxglove look")
        await asyncio.shield(self._looking)

    async def _look(self) -> None:
        names = self._source.names()
        wanted = list(topics_of(names))
        try:
            published = await self._source.relay.published(partial(_is_layer, names))
            self.tells_time = (await self._source.relay.time()).is_simulated
        except TwinUnavailableError:
            published = {}
        wanted += [Topic(name, kind) for name, kind in sorted(published.items())[:MAX_LAYERS]]
        known = {}
        for topic in wanted:
            channel = self._known.get(topic) or await self._channel(topic)
            if channel is not None:
                known[topic] = channel
        if self._known == known:
            return
        self._known = known
        self.topics = {channel.id: topic for topic, channel in known.items()}
        self.channels = {channel.id: channel for channel in known.values()}
        self.wires = {
            key: self.wires.get(key) or channel.json() for key, channel in self.channels.items()
        }
        self._tell(None)

    async def _channel(self, topic: Topic) -> Channel | None:
        if topic.type_name in self._missing:
            return None
        try:
            text = await asyncio.to_thread(schema_text, topic.type_name)
        except LookupError as error:
            self._missing.add(topic.type_name)
            log.warning("%s is not offered to viewers: %s", topic.name, error)
            return None
        return Channel(next(self._ids), topic.name, topic.type_name, text)

    async def _keep_looking(self) -> None:
        while True:
            await asyncio.sleep(LOOK_S)
            try:
                await self.look()
            except Exception:  # nobody waits for this task: the next look comes whatever it was
                log.exception("looking for layers met an error and goes on")

    async def _keep_telling(self) -> None:
        while True:
            await asyncio.sleep(TICK_S)
            if not self.tells_time:
                continue
            try:
                now_ns = (await self._source.relay.time()).now_ns
            except TwinUnavailableError:
                continue
            if now_ns not in (0, self._told_ns):  # 0: nobody has told a time yet
                self._told_ns = now_ns
                self._tell(now_ns)

    def _tell(self, time_ns: int | None) -> None:
        for on_news in list(self._followers):
            try:
                on_news(time_ns)
            except Exception:  # whatever it is: the other followers are told all the same
                log.exception("a viewer met an error")


def _is_layer(names: TwinNames, topic: str, type_name: str) -> bool:
    if type_name == _POINTS:
        return topic.startswith(names.field_layers)
    return type_name == _MARKERS and topic in (names.tags_layer, names.planters_layer)
