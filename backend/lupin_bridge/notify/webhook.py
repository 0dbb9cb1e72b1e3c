"""The webhook: changes of alarms, one POST after the other, each until it is taken.

A change has one id however often it is sent, also after a restart: changes of the day before are
sent once more, and a receiver drops the ids that it has had.
"""

from __future__ import annotations

import asyncio
import base64
import hashlib
import hmac
import logging
import time
from collections import OrderedDict, deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Final, Literal

import orjson

from lupin_bridge.alarms.board import Change, happened_ns
from lupin_bridge.feed.shared_work import end
from lupin_bridge.judge.episodes import Alarm
from lupin_bridge.notify.destinations import WebhookTarget
from lupin_bridge.notify.messages import Source
from lupin_bridge.notify.sending import Backoff, Condition, post, until_taken
from lupin_bridge.stream.state_json import alarm_json
from lupin_twin.core.diagnostics import Origin

log = logging.getLogger(__name__)

MAX_WAITING: Final = 1_000
# Alarms whose last change is known; far more than are active at once.
MAX_KNOWN: Final = 20_000
# Changes of so long before the start are sent again.
RESENT_NS: Final = 24 * 3600 * 1_000_000_000

What = Literal["raised", "worse", "cleared", "withdrawn", "report"]


@dataclass(slots=True)
class Delivery:
    """One change of one alarm, or a report; `id` is the same however often it is sent.

    `origin` is where observations came from when it was received.
    """

    id: str
    change: What
    alarm: Alarm | None
    origin: Origin
    report: orjson.Fragment | None = None
    # Whether it was taken, or given up.
    end: asyncio.Future[bool] | None = None

    def body(self, lost: int, origin: Origin) -> bytes:
        """What is posted; `lost` changes were given up since the last one that was taken.

        `origin` is where observations come from now, for who did not know it then.
        """
        alarm = self.alarm
        of = {"report": self.report} if alarm is None else {"alarm": alarm_json(alarm)}
        origin = origin if self.origin == "unknown" else self.origin
        head = {"id": self.id, "change": self.change}
        return orjson.dumps({**head, **of, "lost": lost, "origin": origin})

    def ended(self, *, taken: bool) -> None:
        """It was taken, or given up."""
        if self.end is not None and not self.end.done():
            self.end.set_result(taken)


class AlarmNews:
    """What is to be sent of changes of alarms; it knows what was sent of each."""

    def __init__(self) -> None:
        # Of each alarm that was sent: when it was cleared, None: it was active; and whether it was
        # worse than as it was raised.
        self._sent: OrderedDict[str, tuple[int | None, bool]] = OrderedDict()

    def of(self, change: Change, now_ns: int | None, origin: Origin) -> Iterator[Delivery]:
        """What is to be sent of a change; `now_ns` is ROS time, None: not known.

        `origin` is where observations come from.
        """
        changed: Iterable[Alarm] = change.changed
        if change.is_past:
            newest_ns = max(map(happened_ns, changed), default=0)
            after_ns = (newest_ns if now_ns is None else now_ns) - RESENT_NS
            changed = (it for it in changed if it.is_active or happened_ns(it) >= after_ns)
        for alarm in sorted(changed, key=happened_ns):
            yield from self._of_alarm(alarm, origin)
        for alarm in change.withdrawn:
            if alarm.id in self._sent:
                del self._sent[alarm.id]
                yield Delivery(f"{alarm.id}.withdrawn", "withdrawn", alarm, origin)

    def _of_alarm(self, alarm: Alarm, origin: Origin) -> Iterator[Delivery]:
        before = self._sent.get(alarm.id)
        now = (alarm.cleared_at_ns, alarm.is_worse)
        if before == now:
            return  # a new worst value alone is nothing that anybody has to be called for
        self._sent[alarm.id] = now
        self._sent.move_to_end(alarm.id)
        if len(self._sent) > MAX_KNOWN:
            self._sent.popitem(last=False)
        was_cleared_ns, was_worse = before or (None, False)
        if alarm.cleared_at_ns is not None:
            if before is None or alarm.cleared_at_ns != was_cleared_ns:
                name = f"{alarm.id}.cleared.{alarm.cleared_at_ns}"
                yield Delivery(name, "cleared", alarm, origin)
            return
        if was_cleared_ns is not None:  # a late write shows that it went on
            yield Delivery(f"{alarm.id}.raised.{was_cleared_ns}", "raised", alarm, origin)
        elif before is None:
            yield Delivery(f"{alarm.id}.raised", "raised", alarm, origin)
        if alarm.is_worse and not was_worse:
            verdict = alarm.reason.verdict
            yield Delivery(f"{alarm.id}.worse.{verdict}", "worse", alarm, origin)


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


FIRST_WAIT_S: Final = 1.0
MOST_WAIT_S: Final = 300.0
# A twin elsewhere says once a second where observations come from, and one of before never does.
ORIGIN_S: Final = 10.0
ORIGIN_POLL_S: Final = 0.1


class Webhook:
    """Belongs to the event loop."""

    name: Final = "webhook"

    def __init__(
        self,
        target: WebhookTarget,
        first_wait_s: float = FIRST_WAIT_S,
        origin_s: float = ORIGIN_S,
    ) -> None:
        self.condition = Condition(is_connected=True)
        self._target = target
        self._news = AlarmNews()
        # Oldest first. Past `MAX_WAITING`, the oldest is given up and counted.
        self._waiting: deque[Delivery] = deque()
        self._has_more = asyncio.Event()
        # Given up since the last one that was taken.
        self._lost = 0
        self._backoff = Backoff(first_wait_s, MOST_WAIT_S)
        self._task: asyncio.Task[None] | None = None
        self._unsubscribe: Callable[[], None] = lambda: None
        self._origin: Callable[[], Origin] = lambda: "unknown"
        self._origin_s = origin_s

    def start(self, source: Source) -> None:
        """Notify of every change from now on, and of what is active already."""
        self._origin = lambda: source.origin

        def receive(change: Change) -> None:
            for delivery in self._news.of(change, source.ros_time_ns, source.origin):
                self._wait(delivery)

        self._unsubscribe = source.alarms.subscribe(receive)
        receive(Change(source.alarms.now.alarms, is_past=True))
        self._task = asyncio.create_task(self._run(), name="webhook")

    @property
    def called(self) -> str:
        """Its address, which may be a secret."""
        return f"{self._target.called}{self._target.path}"

    async def deliver(self, report_id: str, report: orjson.Fragment) -> bool:
        """Send a report until it is taken; False: it was given up, which is logged."""
        end: asyncio.Future[bool] = asyncio.get_running_loop().create_future()
        self._wait(Delivery(report_id, "report", None, self._origin(), report, end))
        return await end

    async def stop(self) -> None:
        """End at once; what was not taken is sent after the next start."""
        self._unsubscribe()
        await end(self._task)

    def _wait(self, delivery: Delivery) -> None:
        if len(self._waiting) >= MAX_WAITING:
            self._waiting.popleft().ended(taken=False)
            self.condition.dropped += 1
            self.condition.waiting -= 1
            self._lost += 1
        self._waiting.append(delivery)
        self.condition.waiting += 1
        self._has_more.set()

    async def _run(self) -> None:
        while True:
            while not self._waiting:
                self._has_more.clear()
                await self._has_more.wait()
            if self._waiting[0].origin == "unknown":
                await self._wait_for_origin()
            delivery, lost = self._waiting.popleft(), self._lost
            try:
                is_taken = await self._send(delivery, lost)
            except Exception as error:
                log.exception("the webhook met an error and goes on")
                self.condition.failing(f"{type(error).__name__} ({self._target.called})")
                self.condition.dropped += 1
                is_taken = False
                # Whatever it was may be so with the next one too.
                await asyncio.sleep(self._backoff.wait_s())
            delivery.ended(taken=is_taken)
            self._lost += -lost if is_taken else 1
            self.condition.waiting -= 1

    async def _send(self, delivery: Delivery, lost: int) -> bool:
        body = delivery.body(lost, self._origin())

        async def attempt() -> None:
            headers = signed(self._target.secret, delivery.id, int(time.time()), body)
            await post(self._target, headers, body)

        what, where = f"{delivery.id} of the webhook", self._target.called
        return await until_taken(attempt, self.condition, self._backoff, what, where)

    async def _wait_for_origin(self) -> None:
        """Until it is known; one that was not in its time is waited for no more."""
        until_s = time.monotonic() + self._origin_s
        while self._origin() == "unknown":
            if time.monotonic() >= until_s:
                self._origin_s = 0.0
                return
            await asyncio.sleep(ORIGIN_POLL_S)
