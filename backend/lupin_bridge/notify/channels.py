"""All channels together, for the bridge: started, watched and stopped with it."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from lupin_bridge.judge.ranges import Sensors
from lupin_bridge.notify.daily import DailyReport, DailyTarget
from lupin_bridge.notify.destinations import Targets
from lupin_bridge.notify.messages import Source
from lupin_bridge.notify.mirror import Mirror
from lupin_bridge.notify.mqtt import Mqtt
from lupin_bridge.notify.push import Push
from lupin_bridge.notify.webhook import Webhook


class DetachedThreads(ThreadPoolExecutor):
    """Threads whose work is not waited for at the end.

    A name server that does not answer holds a thread for half a minute, and asyncio waits for all
    of them as it ends. Here it goes on; what is left ends with the process (`runtime.process`).
    """

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:  # noqa: ARG002
        """End the idle threads, and wait for none."""
        super().shutdown(wait=False, cancel_futures=True)


class Channels:
    """The channels that the operator wants. They look at the state by themselves.

    `folder` is where it is noted which reports were sent. Belongs to the event loop.
    """

    def __init__(
        self,
        targets: Targets | None = None,
        folder: Path = Path(),
        push: Push | None = None,
    ) -> None:
        self._targets, self._folder = targets or Targets(), folder
        self.push = push
        self._mqtt: Mqtt | None = None
        self._webhook: Webhook | None = None
        self._reports: list[DailyReport] = []

    def start(self, source: Source, sensors: Sensors) -> None:
        """Begin to notify."""
        targets = self._targets
        if targets.mqtt is None and targets.webhook is None and self.push is None:
            return
        asyncio.get_running_loop().set_default_executor(
            DetachedThreads(thread_name_prefix="notify")
        )
        if targets.mqtt is not None:
            self._mqtt = Mqtt(targets.mqtt, Mirror(targets.mqtt.topics, sensors))
            self._mqtt.start(source.seen)
        if targets.webhook is not None:
            self._webhook = Webhook(targets.webhook)
            self._webhook.start(source)
        if self.push is not None:
            self.push.start(source)
        if targets.report_at is not None:
            daily = DailyTarget(targets.report_at, source.criteria.clock.zone, self._folder)
            self._reports = [
                DailyReport(daily, it, source) for it in (self._mqtt, self._webhook) if it
            ]
        for report in self._reports:
            report.start()

    async def stop(self) -> None:
        """Stop all at once."""
        await asyncio.gather(*(it.stop() for it in (*self._reports, *self._running)))

    def status(self) -> Mapping[str, str]:
        """What is wrong with each, in a line; empty: nothing."""
        return {it.name: it.condition.detail for it in self._running}

    def counts(self) -> Iterator[tuple[str, Mapping[str, int]]]:
        """The same in numbers, by metric and channel."""
        conditions = {it.name: it.condition for it in self._running}
        yield "lupin_outward_connected", {k: int(it.is_connected) for k, it in conditions.items()}
        yield "lupin_outward_waiting", {k: it.waiting for k, it in conditions.items()}
        yield "lupin_outward_sent", {k: it.sent for k, it in conditions.items()}
        yield "lupin_outward_failed", {k: it.failed for k, it in conditions.items()}
        yield "lupin_outward_dropped", {k: it.dropped for k, it in conditions.items()}

    @property
    def _running(self) -> tuple[Mqtt | Webhook | Push, ...]:
        return tuple(it for it in (self._mqtt, self._webhook, self.push) if it is not None)
