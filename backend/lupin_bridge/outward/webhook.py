"""The webhook: changes of alarms, one POST after the other, each until it is taken."""

from __future__ import annotations

import asyncio
import logging
import random
import time
from collections import deque
from collections.abc import Callable
from typing import Final

from lupin_bridge.alarms.board import AlarmBoard
from lupin_bridge.alarms.ledger import Change, happened_ns
from lupin_bridge.outward.choosing import WebhookTarget
from lupin_bridge.outward.condition import Backoff, Condition
from lupin_bridge.outward.deliveries import Deliveries, signed
from lupin_bridge.outward.post import ANSWER_S, Answered, PostError, post
from lupin_twin.diagnostics import Origin

log = logging.getLogger(__name__)

FIRST_WAIT_S: Final = 1.0
MOST_WAIT_S: Final = 300.0
# A twin elsewhere says once a second where observations come from, and one of before never does.
ORIGIN_S: Final = 10.0
ORIGIN_LOOK_S: Final = 0.1
# What the receiver will not have, however often it comes: this message, not the receiver, is the
# trouble. Others wait behind it, so it is given up.
REFUSALS: Final = frozenset({400, 405, 409, 410, 413, 414, 415, 422, 431})
MAX_REFUSALS: Final = 5
# Alarms that are gone through in one turn of the loop: a millisecond.
AT_ONCE: Final = 200


class Webhook:
    """Belongs to the event loop. `now_ns` tells ROS time, None: not known."""

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

        `origin` tells where observations come from.
        """
        self._origin = origin

        def hear(change: Change) -> None:
            if len(change.changed) + len(change.withdrawn) <= AT_ONCE and not self._changes:
                self._take(change, now_ns())
            else:
                self._changes.append(change)
                self._is_change.set()

        self._unsubscribe = alarms.subscribe(hear)
        hear(Change(tuple(sorted(alarms.now.alarms, key=happened_ns)), is_past=True))
        self._tasks = [
            asyncio.create_task(self._run(), name="webhook"),
            asyncio.create_task(self._take_many(now_ns), name="webhook's changes"),
        ]

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
        """End at once; what was not taken is told after the next start."""
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
                wait_s = await self._try_next()
            except Exception as error:
                log.exception("the webhook met an error and goes on")
                self.condition.failing(f"{type(error).__name__} ({self._target.called})")
                wait_s = MOST_WAIT_S
            self._count()
            await asyncio.sleep(wait_s)

    async def _try_next(self) -> float:
        """Send the first that waits; returns how long to wait before the next, s."""
        while (delivery := self._deliveries.first) is None:
            self._is_news.clear()
            await self._is_news.wait()
        if delivery.origin == "unknown" and self._is_origin_to_come():
            return ORIGIN_LOOK_S
        lost = self._deliveries.lost
        body = delivery.body(lost, self._origin())
        headers = signed(self._target.secret, delivery.id, int(time.time()), body)
        try:
            answer = await post(self._target, headers, body, answer_s=ANSWER_S)
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
        return self._failed(_said(answer), answer.retry_after_s)

    def _is_origin_to_come(self) -> bool:
        """Whether it is not known yet; nobody says it who has not for so long."""
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
        said = self.condition.detail
        if said != before:
            log.warning("the webhook's receiver takes no alarms: %s; it is tried again", said)
        return max(self._backoff.wait_s(random.random()), min(at_least_s, MOST_WAIT_S))  # noqa: S311


def _said(answer: Answered) -> str:
    is_elsewhere = 300 <= answer.status < 400
    return f"answered {answer.status}{', which is not followed' if is_elsewhere else ''}"
