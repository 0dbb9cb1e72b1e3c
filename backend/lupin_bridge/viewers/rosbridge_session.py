"""One rosbridge client: its subscriptions, their rates, and the ROS topics that it gets.

A message of a ROS topic is serialized once for all its clients, by a worker: a map of millions of
cells takes tenths of a second. Messages that wait for a client are bounded by the topic's depth and
bytes: the newest map, the newest 50 observations. Of a throttled topic, only the newest one waits.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, replace
from typing import Final

from lupin_bridge.feed.relay import (
    Bounded,
    NotRelayedError,
    Relay,
    Sample,
    TwinNames,
    absolute,
    topics_of,
)
from lupin_bridge.feed.source import TwinUnavailableError
from lupin_bridge.feed.tasks import Guard, Shared
from lupin_bridge.serving.ws_protocol import shown
from lupin_bridge.stream.frames import StateFrame, text_frame
from lupin_bridge.viewers.rosbridge_protocol import (
    CallService,
    FieldCall,
    Id,
    Refused,
    Subscribe,
    Unsubscribe,
    answer,
    is_type,
    json_of,
    parse,
    publish,
    service_failure,
    service_response,
    status,
)
from lupin_twin.core.interfaces import Topic
from lupin_twin.runtime.workers import Workers

MAX_SUBSCRIPTIONS: Final = 32


@dataclass(frozen=True, slots=True)
class Feed:
    """A subscription to a topic that the client spells `name`."""

    topic: Topic
    name: str
    min_interval_s: float


@dataclass(frozen=True, slots=True)
class Reaction:
    """What a message leads to: replies to send now, a state that is due now, a field to compute.

    `subscribed` is the topic, as the client spells it, whose newest messages are due.
    """

    replies: tuple[bytes, ...] = ()
    state_is_due: bool = False
    subscribed: str | None = None
    field_call: FieldCall | None = None


class Session:
    """The state of one connection."""

    def __init__(self, names: TwinNames) -> None:
        self._names = names
        self._topics = {topic.name: topic for topic in topics_of(names)}
        # By (topic as the client spells it, subscription's id), in the order of subscribing.
        self._subscriptions: dict[tuple[str, Id], Subscribe] = {}

    @property
    def is_subscribed(self) -> bool:
        """Whether the client wants the state, which is written for everybody at once."""
        return bool(self._states())

    @property
    def min_interval_s(self) -> float:
        """The least time between two states: that of the fastest subscription."""
        wanted = self._states()
        return min((self._interval_s(name) for name in wanted), default=0.0)

    @property
    def feeds(self) -> dict[str, Feed]:
        """Its other topics, which come from the relay, by their spelling."""
        return {
            name: Feed(self._topics[absolute(name)], name, self._interval_s(name))
            for name, _ in self._subscriptions
            if not self._is_state(name)
        }

    def _is_state(self, name: str) -> bool:
        return absolute(name) == self._names.state_topic

    def _interval_s(self, name: str) -> float:
        rates = [
            one.throttle_rate for (topic, _), one in self._subscriptions.items() if topic == name
        ]
        return min(rates) / 1000.0

    def _states(self) -> dict[str, None]:
        """The spellings of the state's topic under which it is wanted."""
        return {name: None for name, _ in self._subscriptions if self._is_state(name)}

    def receive(self, message: str | bytes) -> Reaction:
        """Take one frame from the client."""
        try:
            request = parse(message)
            match request:
                case Subscribe():
                    return self._subscribe(request)
                case Unsubscribe():
                    return self._unsubscribe(request)
                case CallService():
                    return self._call_service(request)
        except Refused as refused:
            if refused.service is not None:
                reply = service_failure(refused.id, refused.service, str(refused))
            else:
                reply = status("error", str(refused), refused.id)
            return Reaction((reply,))

    def wire(self, frame: StateFrame) -> bytes:
        """A state as this client reads it: once under each spelling of the topic it subscribed to.

        Serialized once for all clients that use the same spelling.
        """
        return b"".join(
            frame.wire(f"rosbridge {topic}", lambda of=topic: publish(of, frame.message_json()))  # type: ignore[misc]
            for topic in self._states()
        )

    def _subscribe(self, request: Subscribe) -> Reaction:
        topic = self._topics.get(absolute(request.topic))
        if topic is None:
            raise Refused(
                f"topic {shown(request.topic)} is not served, "
                f"expected one of {', '.join(self._topics)}",
                request.id,
            )
        if request.type and not is_type(request.type, topic.type_name):
            raise Refused(f"type is {shown(request.type)}, expected {topic.type_name}", request.id)
        key = (request.topic, request.id)
        if key not in self._subscriptions and len(self._subscriptions) >= MAX_SUBSCRIPTIONS:
            raise Refused(
                f"{len(self._subscriptions)} subscriptions are open, the limit", request.id
            )
        self._subscriptions.pop(key, None)
        self._subscriptions[key] = request
        return Reaction(state_is_due=self._is_state(request.topic), subscribed=request.topic)

    def _unsubscribe(self, request: Unsubscribe) -> Reaction:
        ended = [
            (topic, message_id)
            for topic, message_id in self._subscriptions
            if topic == request.topic and request.id in (None, message_id)
        ]
        for key in ended:
            del self._subscriptions[key]
        if ended:
            return Reaction()
        text = f"there is no such subscription to topic {shown(request.topic)}"
        return Reaction((status("warning", text, request.id),))

    def _call_service(self, request: CallService) -> Reaction:
        reply = answer(request, self._names)
        if isinstance(reply, tuple):
            return Reaction(field_call=reply)
        return Reaction((service_response(request.id, request.service, reply, result=True),))


# Rough worst-case time to serialize, s per byte of CDR.
_WRITE_S: Final = 1e-7


class Writer:
    """Serializes samples as frames; all clients share one. Belongs to the event loop."""

    def __init__(self, relay: Relay, workers: Workers) -> None:
        self.relay = relay
        self._workers = workers
        self._writing: Shared[bytes] = Shared()

    async def frame(self, feed: Feed, sample: Sample) -> bytes:
        """The sample as a frame for a feed; concurrent requests for the same one share it.

        Raises:
            ValueError: not a message of the topic's type.

        """

        def written(_: object) -> bytes:
            message = json_of(self.relay.read(feed.topic, sample))
            return text_frame(publish(feed.name, message))

        async def write() -> bytes:
            cost_s = len(sample.data) * _WRITE_S
            return await asyncio.wrap_future(self._workers.submit(written, cost_s))

        return await self._writing.get((feed.name, id(sample)), write)


class Feeds:
    """One client's feeds: each is a task that waits for the client and never for another."""

    def __init__(self, writer: Writer, send: Callable[[bytes], Awaitable[None]]) -> None:
        self._writer = writer
        self._send = send
        self._tasks: dict[str, tuple[Feed, asyncio.Task[None]]] = {}

    def follow(self, feeds: dict[str, Feed], renewed: str | None) -> None:
        """Run exactly these feeds, by their spelling; restart the one that is `renewed`."""
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
            close = await self._writer.relay.listen(feed.topic, take)
        except (NotRelayedError, TwinUnavailableError) as error:
            await self._send(text_frame(status("error", str(error))))
            return
        guard = Guard(f"rosbridge, {feed.topic.name}", ValueError)
        try:
            while True:
                await has_come.wait()
                has_come.clear()
                while waiting:
                    frame = await guard.run(self._writer.frame(feed, waiting.take()))
                    if isinstance(frame, Exception):
                        is_known = isinstance(frame, ValueError)
                        why = str(frame) if is_known else "an internal error, see the bridge's log"
                        text = f"a message of topic {shown(feed.name)} is left out: {why}"
                        frame = text_frame(status("error", text))
                    await self._send(frame)
                    if feed.min_interval_s:
                        await asyncio.sleep(feed.min_interval_s)
        finally:
            close()
