"""Changes of alarms that a receiver has to be told, in their order, each with an id. Pure.

What is sent again has the same id, also after a restart: what happened within a day before is told
once more, for nobody knows what was taken. A receiver drops the ids that it has had.
"""

from __future__ import annotations

import base64
import hashlib
import hmac
from collections import OrderedDict, deque
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final, Literal

import orjson

from lupin_bridge.alarms.ledger import Change, happened_ns
from lupin_bridge.judge.alarm import Alarm
from lupin_bridge.stream.health_json import alarm_json
from lupin_twin.diagnostics import Origin

MAX_WAITING: Final = 1_000
# Alarms whose last change is known; far more than are active at once.
MAX_KNOWN: Final = 20_000
# Of the past, so much is told at the start.
TOLD_AGAIN_NS: Final = 24 * 3600 * 1_000_000_000

What = Literal["raised", "worse", "cleared", "withdrawn"]


@dataclass(slots=True)
class Delivery:
    """One change of one alarm; `id` is the same however often it is sent.

    `origin` is where observations came from when it was heard of.
    """

    id: str
    change: What
    alarm: Alarm
    origin: Origin
    refusals: int = 0

    def body(self, lost: int, origin: Origin) -> bytes:
        """What is posted; `lost` changes were given up since the last one that was taken.

        `origin` is where observations come from now, for who did not know it then.
        """
        return orjson.dumps(
            {
                "id": self.id,
                "change": self.change,
                "alarm": alarm_json(self.alarm),
                "lost": lost,
                "origin": origin if self.origin == "unknown" else self.origin,
            }
        )


class Deliveries:
    """What waits, oldest first. Past `MAX_WAITING`, the oldest is given up and counted."""

    def __init__(self, max_waiting: int = MAX_WAITING) -> None:
        self._max = max_waiting
        self._waiting: deque[Delivery] = deque()
        # Of each alarm that was told: when it was said to be cleared, None: that it is active; and
        # whether it was said to be worse than as it was raised.
        self._told: OrderedDict[str, tuple[int | None, bool]] = OrderedDict()
        self.dropped = 0
        self.lost = 0

    def __len__(self) -> int:
        return len(self._waiting)

    @property
    def first(self) -> Delivery | None:
        """The next one; it goes on waiting until it is `over`."""
        return self._waiting[0] if self._waiting else None

    def over(self, delivery: Delivery, *, taken: bool, lost: int = 0) -> None:
        """It was taken, and with it that so many were `lost`; or it was given up.

        Meanwhile it may have given way to newer ones, and more may have been lost.
        """
        if taken:
            self.lost -= lost
            if self.first is not delivery:
                self.lost -= 1  # this one, after all, was not
        if self._waiting and self._waiting[0] is delivery:
            self._waiting.popleft()
            if not taken:
                self._give_up()

    def put(self, change: Change, now_ns: int | None, origin: Origin) -> None:
        """Take what is to be told of a change; `now_ns` is ROS time, None: not known.

        `origin` is where observations come from.
        """
        changed: Iterable[Alarm] = change.changed
        if change.is_past:
            newest_ns = max(map(happened_ns, changed), default=0)
            after_ns = (newest_ns if now_ns is None else now_ns) - TOLD_AGAIN_NS
            changed = (it for it in changed if it.is_active or happened_ns(it) >= after_ns)
        for alarm in sorted(changed, key=happened_ns):
            self._put_alarm(alarm, origin)
        for alarm in change.withdrawn:
            if alarm.id in self._told:
                del self._told[alarm.id]
                self._wait(Delivery(f"{alarm.id}.withdrawn", "withdrawn", alarm, origin))

    def _put_alarm(self, alarm: Alarm, origin: Origin) -> None:
        before = self._told.get(alarm.id)
        now = (alarm.cleared_at_ns, alarm.is_worse)
        if before == now:
            return  # a new worst value alone is nothing that anybody has to be called for
        self._told[alarm.id] = now
        self._told.move_to_end(alarm.id)
        if len(self._told) > MAX_KNOWN:
            self._told.popitem(last=False)
        was_cleared_ns, was_worse = before or (None, False)
        if alarm.cleared_at_ns is not None:
            if before is None or alarm.cleared_at_ns != was_cleared_ns:
                self._wait(
                    Delivery(f"{alarm.id}.cleared.{alarm.cleared_at_ns}", "cleared", alarm, origin)
                )
            return
        if was_cleared_ns is not None:  # what was heard late shows that it went on
            self._wait(Delivery(f"{alarm.id}.raised.{was_cleared_ns}", "raised", alarm, origin))
        elif before is None:
            self._wait(Delivery(f"{alarm.id}.raised", "raised", alarm, origin))
        if alarm.is_worse and not was_worse:
            verdict = alarm.reason.verdict
            self._wait(Delivery(f"{alarm.id}.worse.{verdict}", "worse", alarm, origin))

    def _wait(self, delivery: Delivery) -> None:
        self._waiting.append(delivery)
        if len(self._waiting) > self._max:
            self._waiting.popleft()
            self._give_up()

    def _give_up(self) -> None:
        self.dropped += 1
        self.lost += 1


def signed(secret: bytes, delivery_id: str, now_s: int, body: bytes) -> dict[str, str]:
    """The headers by which a receiver knows who sent it, and when (s since the epoch).

    https://github.com/standard-webhooks/standard-webhooks, version 1: the HMAC-SHA256 of id, time
    and body, with a full stop between them.
    """
    mac = hmac.new(secret, f"{delivery_id}.{now_s}.".encode() + body, hashlib.sha256).digest()
    return {
        "webhook-id": delivery_id,
        "webhook-timestamp": str(now_s),
        "webhook-signature": f"v1,{base64.b64encode(mac).decode('ascii')}",
    }
