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
import random
import time
from collections import OrderedDict, deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Final, Literal

import orjson

from lupin_bridge.alarms.board import AlarmBoard
from lupin_bridge.alarms.ledger import Change, happened_ns
from lupin_bridge.judge.alarm import Alarm
from lupin_bridge.notify.destinations import Backoff, Condition, WebhookTarget
from lupin_bridge.notify.http_post import PostAnswer, PostError, post
from lupin_bridge.stream.health_json import alarm_json
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
    refusals: int = 0
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


class Deliveries:
    """What waits, oldest first. Past `MAX_WAITING`, the oldest is given up and counted."""

    def __init__(self, max_waiting: int = MAX_WAITING) -> None:
        self._max = max_waiting
        self._waiting: deque[Delivery] = deque()
        # Of each alarm that was sent: when it was cleared, None: it was active; and whether it was
        # worse than as it was raised.
        self._sent: OrderedDict[str, tuple[int | None, bool]] = OrderedDict()
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
        delivery.ended(taken=taken)
        if taken:
            self.lost -= lost
            if self.first is not delivery:
                self.lost -= 1  # this one, after all, was not
        if self._waiting and self._waiting[0] is delivery:
            self._waiting.popleft()
            if not taken:
                self._give_up()

    def put(self, change: Change, now_ns: int | None, origin: Origin) -> None:
        """Take what is to be sent of a change; `now_ns` is ROS time, None: not known.

        `origin` is where observations come from.
        """
        changed: Iterable[Alarm] = change.changed
        if change.is_past:
            newest_ns = max(map(happened_ns, changed), default=0)
            after_ns = (newest_ns if now_ns is None else now_ns) - RESENT_NS
            changed = (it for it in changed if it.is_active or happened_ns(it) >= after_ns)
        for alarm in sorted(changed, key=happened_ns):
            self._put_alarm(alarm, origin)
        for alarm in change.withdrawn:
            if alarm.id in self._sent:
                del self._sent[alarm.id]
                self.wait(Delivery(f"{alarm.id}.withdrawn", "withdrawn", alarm, origin))

    def _put_alarm(self, alarm: Alarm, origin: Origin) -> None:
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
                self.wait(
                    Delivery(f"{alarm.id}.cleared.{alarm.cleared_at_ns}", "cleared", alarm, origin)
                )
            return
        if was_cleared_ns is not None:  # a late write shows that it went on
            self.wait(Delivery(f"{alarm.id}.raised.{was_cleared_ns}", "raised", alarm, origin))
        elif before is None:
            self.wait(Delivery(f"{alarm.id}.raised", "raised", alarm, origin))
        if alarm.is_worse and not was_worse:
            verdict = alarm.reason.verdict
            self.wait(Delivery(f"{alarm.id}.worse.{verdict}", "worse", alarm, origin))

    def wait(self, delivery: Delivery) -> None:
        """Have it wait for its turn."""
        self._waiting.append(delivery)
        if len(self._waiting) > self._max:
            self._waiting.popleft().ended(taken=False)
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


FIRST_WAIT_S: Final = 1.0
MOST_WAIT_S: Final = 300.0
# A twin elsewhere says once a second where observations come from, and one of before never does.
ORIGIN_S: Final = 10.0
ORIGIN_POLL_S: Final = 0.1
# What the receiver will not have, however often it comes: this message, not the receiver, is the
# trouble. Others wait behind it, so it is given up.
REFUSALS: Final = frozenset({400, 405, 409, 410, 413, 414, 415, 422, 431})
MAX_REFUSALS: Final = 5
# Alarms that are gone through in one turn of the loop: a millisecond.
AT_ONCE: Final = 200


class Webhook:
    """Belongs to the event loop. `now_ns` returns ROS time, None: not known."""

    name: Final = "webhook"

    def __init__(
        self,
        target: WebhookTarget,
        first_wait_s: float = FIRST_WAIT_S,
        origin_s: float = ORIGIN_S,
    ) -> None:
        self.condition = Condition(is_connected=True)
        self._target = target
        self._deliveries = Deliveries()
        self._backoff = Backoff(first_wait_s, MOST_WAIT_S)
        self._is_news = asyncio.Event()
        self._changes: deque[Change] = deque()
        self._is_change = asyncio.Event()
        self._tasks: list[asyncio.Task[None]] = []
        self._unsubscribe: Callable[[], None] = lambda: None
        self._origin: Callable[[], Origin] = lambda: "unknown"
        self._origin_s = origin_s
        # Since when a delivery has waited for the origin alone.
        self._unknown_since_s: float | None = None

    def start(
        self, alarms: AlarmBoard, now_ns: Callable[[], int | None], origin: Callable[[], Origin]
    ) -> None:
        """Tell of every change from now on, and of what is active already.

        `origin` returns where observations come from.
        """
        self._origin = origin

        def receive(change: Change) -> None:
            if len(change.changed) + len(change.withdrawn) <= AT_ONCE and not self._changes:
                self._take(change, now_ns())
            else:
                self._changes.append(change)
                self._is_change.set()

        self._unsubscribe = alarms.subscribe(receive)
        receive(Change(tuple(sorted(alarms.now.alarms, key=happened_ns)), is_past=True))
        self._tasks = [
            asyncio.create_task(self._run(), name="webhook"),
            asyncio.create_task(self._take_many(now_ns), name="webhook's changes"),
        ]

    @property
    def called(self) -> str:
        """Its address, which may be a secret."""
        return f"{self._target.called}{self._target.path}"

    async def deliver(self, report_id: str, report: orjson.Fragment) -> bool:
        """See `daily.ReportChannel`."""
        end: asyncio.Future[bool] = asyncio.get_running_loop().create_future()
        self._deliveries.wait(Delivery(report_id, "report", None, self._origin(), 0, report, end))
        self._count()
        self._is_news.set()
        return await end

    def _take(self, change: Change, now_ns: int | None) -> None:
        self._deliveries.put(change, now_ns, self._origin())
        self._count()
        self._is_news.set()

    async def _take_many(self, now_ns: Callable[[], int | None]) -> None:
        """What is too much for one turn of the loop, such as a past, part by part."""
        while True:
            await self._is_change.wait()
            self._is_change.clear()
            while self._changes:
                change = self._changes[0]
                newest_ns = happened_ns(change.changed[-1]) if change.changed else None
                for part in change.parts(AT_ONCE):
                    self._take(part, newest_ns if (now := now_ns()) is None else now)
                    await asyncio.sleep(0)
                self._changes.popleft()

    async def stop(self) -> None:
        """End at once; what was not taken is sent after the next start."""
        self._unsubscribe()
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    def _count(self) -> None:
        self.condition.waiting = len(self._deliveries)
        self.condition.dropped = self._deliveries.dropped

    async def _run(self) -> None:
        while True:
            try:
                wait_s = await self._attempt_next()
            except Exception as error:
                log.exception("the webhook met an error and goes on")
                self.condition.failing(f"{type(error).__name__} ({self._target.called})")
                wait_s = MOST_WAIT_S
            self._count()
            await asyncio.sleep(wait_s)

    async def _attempt_next(self) -> float:
        """Send the first that waits; returns how long to wait before the next, s."""
        while (delivery := self._deliveries.first) is None:
            self._is_news.clear()
            await self._is_news.wait()
        if delivery.origin == "unknown" and self._is_origin_to_come():
            return ORIGIN_POLL_S
        lost = self._deliveries.lost
        body = delivery.body(lost, self._origin())
        headers = signed(self._target.secret, delivery.id, int(time.time()), body)
        try:
            answer = await post(self._target, headers, body)
        except PostError as error:
            return self._failed(str(error))
        if 200 <= answer.status < 300:
            self._deliveries.over(delivery, taken=True, lost=lost)
            self._backoff.succeeded()
            if self.condition.detail:
                log.info("the webhook's receiver at %s takes alarms again", self._target.called)
            self.condition.taken()
            return 0.0
        if answer.status in REFUSALS:
            delivery.refusals += 1
            if delivery.refusals >= MAX_REFUSALS:
                log.error(
                    "the webhook's receiver at %s refused %s with %d, %d times: it is given up",
                    self._target.called,
                    delivery.id,
                    answer.status,
                    delivery.refusals,
                )
                self._deliveries.over(delivery, taken=False)
        return self._failed(_problem(answer), answer.retry_after_s)

    def _is_origin_to_come(self) -> bool:
        """Whether it may still come: not known yet, and not for so long."""
        if self._origin() != "unknown":
            self._unknown_since_s = None
            return False
        now_s = time.monotonic()
        if self._unknown_since_s is None:
            self._unknown_since_s = now_s
        return now_s - self._unknown_since_s < self._origin_s

    def _failed(self, why: str, at_least_s: float = 0.0) -> float:
        before = self.condition.detail
        self.condition.failing(f"{why} ({self._target.called})")
        problem = self.condition.detail
        if problem != before:
            log.warning("the webhook's receiver takes no alarms: %s; it is tried again", problem)
        return max(self._backoff.wait_s(random.random()), min(at_least_s, MOST_WAIT_S))  # noqa: S311


def _problem(answer: PostAnswer) -> str:
    is_elsewhere = 300 <= answer.status < 400
    return f"answered {answer.status}{', which is not followed' if is_elsewhere else ''}"
