"""One rosbridge client: what it has subscribed to, how much it is told, how fast it may talk.

Pure: the time is an argument, seconds of a clock that never jumps.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Final

from lupin_bridge.rosbridge import protocol as rosbridge
from lupin_bridge.rosbridge import services as rosbridge_services
from lupin_bridge.rosbridge.protocol import (
    LEVELS,
    CallService,
    Id,
    Level,
    Refused,
    SetLevel,
    Subscribe,
    Unsubscribe,
)
from lupin_bridge.rosbridge.services import FieldCall
from lupin_bridge.serving.client_messages import ClientPace, shown
from lupin_bridge.stream.frames import StateFrame
from lupin_bridge.twin.names import Topic, TwinNames, topics_of

MAX_SUBSCRIPTIONS: Final = 32


@dataclass(frozen=True, slots=True)
class Feed:
    """What a client wants of a topic that it spells `name`, and how."""

    topic: Topic
    name: str
    min_interval_s: float


@dataclass(frozen=True, slots=True)
class Reaction:
    """What a message leads to: replies to send now, a state that is due now, a field to compute.

    `subscribed` is the topic, as the client spells it, whose newest messages it is owed.
    """

    replies: tuple[bytes, ...] = ()
    state_is_due: bool = False
    subscribed: str | None = None
    field_call: FieldCall | None = None


class Session:
    """The state of one connection."""

    def __init__(self, names: TwinNames) -> None:
        self._names = names
        self._level: Level = "warning"
        self._pace = ClientPace()
        self._topics = {topic.name: topic for topic in topics_of(names)}
        # By (topic as the client spells it, subscription's id); the last made is the last.
        self._subscriptions: dict[tuple[str, Id], Subscribe] = {}

    @property
    def is_subscribed(self) -> bool:
        """Whether the client wants the state, which is written for everybody at once."""
        return bool(self._states())

    @property
    def min_interval_s(self) -> float:
        """The least time between two states: that of the subscription in the greatest hurry."""
        wanted = self._states()
        return min((self._interval_s(name) for name in wanted), default=0.0)

    @property
    def feeds(self) -> dict[str, Feed]:
        """Whatever else it wants, by the topic as it spells it: to be heard off the wire of ROS."""
        return {
            name: Feed(self._topic(name), name, self._interval_s(name))
            for name, _ in self._subscriptions
            if not self._is_state(name)
        }

    def _topic(self, name: str) -> Topic:
        return self._topics[rosbridge_services.absolute(name)]

    def _is_state(self, name: str) -> bool:
        return self._topic(name).name == self._names.state_topic

    def _interval_s(self, name: str) -> float:
        rates = [
            one.throttle_rate_ms for (topic, _), one in self._subscriptions.items() if topic == name
        ]
        return min(rates) / 1000.0

    def _states(self) -> dict[str, None]:
        """The spellings of the state's topic under which it is wanted."""
        return {name: None for name, _ in self._subscriptions if self._is_state(name)}

    def receive(self, message: str | bytes, now_s: float) -> Reaction:
        """Take one frame from the client.

        Raises:
            TooManyMessages: the client has to go.

        """
        self._pace.take(now_s)
        try:
            request = rosbridge.parse(message)
            match request:
                case Subscribe():
                    return self._subscribe(request)
                case Unsubscribe():
                    return self._unsubscribe(request)
                case CallService():
                    return self._call_service(request)
                case SetLevel():
                    self._level = request.level
                    return Reaction()
        except Refused as refused:
            return Reaction(self._refusal(refused))

    def wire(self, frame: StateFrame) -> bytes:
        """A state as this client reads it: once under each spelling of the topic it subscribed to.

        Written once for all clients that spell it alike.
        """
        spellings = self._states()
        return b"".join(
            frame.wire(f"rosbridge {topic}", partial(_published, topic, frame))
            for topic in spellings
        )

    def _subscribe(self, request: Subscribe) -> Reaction:
        topic = self._topics.get(rosbridge_services.absolute(request.topic))
        if topic is None:
            raise Refused(
                f"topic {shown(request.topic)} is not served, "
                f"expected one of {', '.join(self._topics)}",
                request.id,
            )
        if request.type and not rosbridge_services.is_type(request.type, topic.type_name):
            raise Refused(f"type is {shown(request.type)}, expected {topic.type_name}", request.id)
        key = (request.topic, request.id)
        if key not in self._subscriptions and len(self._subscriptions) >= MAX_SUBSCRIPTIONS:
            raise Refused(
                f"{len(self._subscriptions)} subscriptions are open, the limit", request.id
            )
        self._subscriptions.pop(key, None)
        self._subscriptions[key] = request
        return Reaction(
            self._warn(request.warnings, request.id),
            state_is_due=self._is_state(request.topic),
            subscribed=request.topic,
        )

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
        return Reaction(self._warn((text,), request.id))

    def _call_service(self, request: CallService) -> Reaction:
        warnings = self._warn(request.warnings, request.id)
        answer = rosbridge_services.answer(request, self._names)
        if isinstance(answer, FieldCall):
            return Reaction(warnings, field_call=answer)
        response = rosbridge.service_response(request.id, request.service, answer, result=True)
        return Reaction((*warnings, response))

    def _refusal(self, refused: Refused) -> tuple[bytes, ...]:
        if refused.service is not None:
            return (rosbridge.service_failure(refused.id, refused.service, str(refused)),)
        return self._status("error", str(refused), refused.id)

    def _warn(self, texts: tuple[str, ...], message_id: Id) -> tuple[bytes, ...]:
        return tuple(reply for text in texts for reply in self._status("warning", text, message_id))

    def _status(self, level: Level, text: str, message_id: Id) -> tuple[bytes, ...]:
        if LEVELS.index(level) > LEVELS.index(self._level):
            return ()
        return (rosbridge.status(level, text, message_id),)


def _published(topic: str, frame: StateFrame) -> bytes:
    return rosbridge.publish(topic, frame.message_json)
