"""One rosbridge client: its subscriptions, their rates, and the ROS topics that it gets.

A message of a ROS topic is serialized once for all its clients, by a worker: a map of millions of
cells takes tenths of a second.
"""

from __future__ import annotations

import asyncio
from dataclasses import dataclass
from typing import Final

from lupin_bridge.feed.relay import Feed, Relay, Sample, TwinNames, absolute, topics_of
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
from lupin_twin.runtime.workers import Workers

MAX_SUBSCRIPTIONS: Final = 32


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
        self._relay = relay
        self._workers = workers
        self._writing = Shared()
        # By topic.
        self._guards: dict[str, Guard] = {}

    async def frame(self, feed: Feed, sample: Sample) -> bytes:
        """The sample as a frame for a feed, or an error; concurrent requests for one share it."""

        def written(_: object) -> bytes:
            message = json_of(self._relay.read(feed.topic, sample))
            return text_frame(publish(str(feed.name), message))

        async def write() -> bytes:
            cost_s = len(sample.data) * _WRITE_S
            return await asyncio.wrap_future(self._workers.submit(written, cost_s))

        topic = feed.topic.name
        guard = self._guards.setdefault(topic, Guard(f"rosbridge, {topic}", ValueError))
        frame = await guard.run(self._writing.get((feed.name, id(sample)), write))
        if not isinstance(frame, Exception):
            return frame
        is_known = isinstance(frame, ValueError)
        why = str(frame) if is_known else "an internal error, see the bridge's log"
        text = f"a message of topic {shown(feed.name)} is left out: {why}"
        return text_frame(status("error", text))
