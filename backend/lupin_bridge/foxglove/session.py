"""One client of Foxglove's protocol: what it has subscribed to, and what it lacks. Pure.

Of each subscription the newest message is what a client that takes its time gets next: what came
before, and could not be written, gives way. The time is an argument, seconds that never jump.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from lupin_bridge.foxglove import protocol
from lupin_bridge.foxglove.protocol import MAX_SUBSCRIPTIONS, Channel, Refused, Subscribe
from lupin_bridge.serving.client_messages import ClientPace, shown

# The largest message that one client is sent: a map of 4,000 × 4,000 cells has 16 MB, a layer of a
# million points 20. What waits for one that does not read is one such message.
MAX_MESSAGE_BYTES: Final = 24_000_000


@dataclass(frozen=True, slots=True)
class Message:
    """A message on its way: its payload is the relay's own bytes, shared with everybody."""

    payload: bytes
    stamp_ns: int


@dataclass(slots=True)
class Counts:
    """Messages that were written to clients, and those that gave way to newer ones."""

    sent: int = 0
    skipped: int = 0


@dataclass(frozen=True, slots=True)
class Reaction:
    """What a message leads to: replies, and subscriptions (id and channel) to begin or to end."""

    replies: tuple[bytes, ...] = ()
    begun: tuple[tuple[int, Channel], ...] = ()
    ended: tuple[int, ...] = ()


class Session:
    """The state of one connection."""

    def __init__(self, counts: Counts) -> None:
        self._counts = counts
        self._pace = ClientPace()
        self._subscriptions: dict[int, Channel] = {}
        self._advertised: dict[int, Channel] = {}
        self._waiting: dict[int, Message] = {}
        self._too_large: set[int] = set()
        self._time_ns: int | None = None

    def receive(self, message: str | bytes, now_s: float) -> Reaction:
        """Take one message from the client.

        Raises:
            TooManyMessages: the client has to go.

        """
        self._pace.take(now_s)
        try:
            request = protocol.parse(message)
        except Refused as refused:
            return Reaction((protocol.status(protocol.ERROR, str(refused)),))
        if isinstance(request, Subscribe):
            return self._subscribe(request)
        return self._unsubscribe(request.ids)

    def offer(self, channels: Mapping[int, Channel], wires: Mapping[int, bytes]) -> Reaction:
        """What the client has to be told of the channels that there are now.

        Subscriptions to those that are gone end.
        """
        gone = self._advertised.keys() - channels.keys()
        new = [channel_id for channel_id in channels if channel_id not in self._advertised]
        replies = []
        if gone:
            replies.append(protocol.unadvertise(gone))
        if new or not self._advertised:
            replies.append(protocol.advertise(wires[channel_id] for channel_id in new))
        self._advertised = dict(channels)
        ended = [key for key, channel in self._subscriptions.items() if channel.id in gone]
        for key in ended:
            self._end(key)
        return Reaction(tuple(replies), ended=tuple(ended))

    def has(self, subscription_id: int, channel: Channel) -> bool:
        """Whether this subscription is open."""
        return self._subscriptions.get(subscription_id) is channel

    def give_up(self, subscription_id: int) -> None:
        """A subscription cannot be served after all."""
        if subscription_id in self._subscriptions:
            self._end(subscription_id)

    def put(self, subscription_id: int, message: Message) -> bytes | None:
        """A message has come for a subscription; returns a reply, if there is something to say."""
        channel = self._subscriptions.get(subscription_id)
        if channel is None:
            return None
        if len(message.payload) > MAX_MESSAGE_BYTES:
            return self._leave_out(channel, len(message.payload))
        self._counts.skipped += subscription_id in self._waiting
        # Behind the others that wait: one fast channel must not keep them from their turn.
        self._waiting.pop(subscription_id, None)
        self._waiting[subscription_id] = message
        return None

    def put_time(self, stamp_ns: int) -> None:
        """Simulated time goes on."""
        self._time_ns = stamp_ns

    def next(self) -> tuple[bytes, bytes] | None:
        """What is to be written next, as a binary message in two parts; None: nothing waits."""
        if self._time_ns is not None:
            head = protocol.time(self._time_ns)
            self._time_ns = None
            return head, b""
        if not self._waiting:
            return None
        subscription_id = next(iter(self._waiting))
        message = self._waiting.pop(subscription_id)
        self._counts.sent += 1
        return protocol.message_head(subscription_id, message.stamp_ns), message.payload

    def _subscribe(self, request: Subscribe) -> Reaction:
        begun: list[tuple[int, Channel]] = []
        errors = []
        for key, channel_id in request.subscriptions:
            channel = self._advertised.get(channel_id)
            if channel is None:
                errors.append(f"there is no channel {channel_id}")
            elif key in self._subscriptions:
                errors.append(f"subscription {key} is in use")
            elif channel in self._subscriptions.values():
                errors.append(f"channel {channel_id} is subscribed to already")
            elif len(self._subscriptions) >= MAX_SUBSCRIPTIONS:
                errors.append(f"{MAX_SUBSCRIPTIONS} subscriptions are open, the limit")
            else:
                self._subscriptions[key] = channel
                begun.append((key, channel))
        return Reaction(_told(errors), begun=tuple(begun))

    def _unsubscribe(self, ids: tuple[int, ...]) -> Reaction:
        ended = [key for key in dict.fromkeys(ids) if key in self._subscriptions]
        for key in ended:
            self._end(key)
        errors = [f"there is no subscription {key}" for key in ids if key not in ended]
        return Reaction(_told(errors), ended=tuple(ended))

    def _end(self, subscription_id: int) -> None:
        del self._subscriptions[subscription_id]
        self._waiting.pop(subscription_id, None)

    def _leave_out(self, channel: Channel, size: int) -> bytes | None:
        if channel.id in self._too_large:
            return None  # said once
        self._too_large.add(channel.id)
        return protocol.status(
            protocol.WARNING,
            f"messages on {shown(channel.topic)} are left out while they are larger than "
            f"{MAX_MESSAGE_BYTES} bytes: this one has {size}",
        )


def _told(errors: list[str]) -> tuple[bytes, ...]:
    # One for all: what is answered is never more than was asked.
    return (protocol.status(protocol.ERROR, "; ".join(errors)),) if errors else ()
