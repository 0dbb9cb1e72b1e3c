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
from lupin_bridge.rosbridge.services import STATE_TYPE, FieldCall
from lupin_bridge.serving.rate_limit import RateLimit
from lupin_bridge.stream.frames import JSON, StateFrame
from lupin_bridge.twin.source import TwinNames

MAX_SUBSCRIPTIONS: Final = 32

# A page subscribes a few times and then calls a service now and again; more fields than
# `field_rate_hz` (20 a second) it does not get anyway.
MAX_MESSAGES_PER_S: Final = 100
MAX_BURST: Final = 500


class TooManyMessages(ValueError):
    """A client that sends faster than any use of it could need."""


@dataclass(frozen=True, slots=True)
class Reaction:
    """What a message leads to: replies to send now, a state that is due now, a field to compute."""

    replies: tuple[bytes, ...] = ()
    state_is_due: bool = False
    field_call: FieldCall | None = None


class Session:
    """The state of one connection."""

    def __init__(self, names: TwinNames) -> None:
        self._names = names
        self._level: Level = "warning"
        self._pace = RateLimit(MAX_MESSAGES_PER_S, MAX_BURST)
        # (topic as the client spells it, subscription's id) to the least interval in ms.
        self._subscriptions: dict[tuple[str, Id], float] = {}

    @property
    def is_subscribed(self) -> bool:
        """Whether the client wants the state at all."""
        return bool(self._subscriptions)

    @property
    def min_interval_s(self) -> float:
        """The least time between two states: that of the subscription in the greatest hurry."""
        return min(self._subscriptions.values(), default=0.0) / 1000.0

    def receive(self, message: str | bytes, now_s: float) -> Reaction:
        """Take one frame from the client.

        Raises:
            TooManyMessages: the client has to go.

        """
        if self._pace.take("", now_s) > 0.0:
            raise TooManyMessages(
                f"more than {MAX_MESSAGES_PER_S} messages a second after {MAX_BURST} at once"
            )
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
        spellings = dict.fromkeys(topic for topic, _ in self._subscriptions)
        return b"".join(
            frame.wire(f"rosbridge {topic}", JSON, partial(_published, topic, frame))
            for topic in spellings
        )

    def _subscribe(self, request: Subscribe) -> Reaction:
        if rosbridge_services.absolute(request.topic) != self._names.state_topic:
            raise Refused(
                f"topic {rosbridge.shown(request.topic)} is not served, "
                f"expected {self._names.state_topic}",
                request.id,
            )
        if request.type and not rosbridge_services.is_type(request.type, STATE_TYPE):
            raise Refused(
                f"type is {rosbridge.shown(request.type)}, expected {STATE_TYPE}", request.id
            )
        key = (request.topic, request.id)
        if key not in self._subscriptions and len(self._subscriptions) >= MAX_SUBSCRIPTIONS:
            raise Refused(
                f"{len(self._subscriptions)} subscriptions are open, the limit", request.id
            )
        self._subscriptions[key] = request.throttle_rate_ms
        return Reaction(self._warn(request.warnings, request.id), state_is_due=True)

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
        text = f"there is no such subscription to topic {rosbridge.shown(request.topic)}"
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
