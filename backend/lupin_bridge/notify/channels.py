"""All notification channels of a bridge, and the daily report that they send.

A report that is not taken is retried as alarms are. As with alarms, nothing is noted of what was
sent: after a start, the report of the last day comes once more, with the same id.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from datetime import datetime, time, timedelta, tzinfo
from functools import partial
from typing import Final

import orjson
from aiomqtt import MqttError

from lupin_bridge.alarms.board import Change
from lupin_bridge.feed.source import TwinUnavailableError
from lupin_bridge.feed.tasks import Guard, Periodic
from lupin_bridge.judge.judging import unix_s
from lupin_bridge.judge.quantities import Sensors
from lupin_bridge.notify.destinations import Targets
from lupin_bridge.notify.messages import Source
from lupin_bridge.notify.mqtt import Mirror, Mqtt
from lupin_bridge.notify.push import Push
from lupin_bridge.notify.webhook import Webhook
from lupin_bridge.past.plans import answered
from lupin_bridge.past.report import REPORT_S, Report
from lupin_bridge.query_string import compact
from lupin_twin.core.past import NotRemembered, PastRefused

log = logging.getLogger(__name__)

POLL_S: Final = 2.0
# How long a report waits for the log to be complete up to the end of the day.
LATE_NS: Final = 300 * 1_000_000_000


def ended_ns(at: time, zone: tzinfo | None, now_ns: int, days: int = 0) -> int:
    """The end of the operator's last day that is over at a moment, or of the one `days` days later.

    A day ends at `at` in `zone`; None: this machine's.
    """
    now = datetime.fromtimestamp(now_ns // 1_000_000_000, zone)
    passed = 0 if now.timetz().replace(tzinfo=None) >= at else 1
    day = now.date() + timedelta(days=days - passed)
    return int(datetime.combine(day, at, zone).timestamp()) * 1_000_000_000


class DailyReport(Periodic):
    """Sends the report of each day by one channel."""

    def __init__(self, at: time, channel: Mqtt | Webhook, of: Source) -> None:
        super().__init__(self._attempt, POLL_S, "the report of the day", first_s=0.0)
        self._channel, self._of = channel, of
        self._ended_ns = partial(ended_ns, at, of.criteria.clock.zone)
        known = NotRemembered, PastRefused, TwinUnavailableError, OSError, MqttError
        self._guard = Guard(f"the report of the day is not sent by {channel.name}", *known)
        # The end of the last day that was sent or skipped; 0: none.
        self._sent_ns = 0

    async def _attempt(self) -> None:
        await self._guard.run(self._look())

    async def _look(self) -> None:
        """Send the report that is due.

        Raises:
            Exception: it cannot be sent, for this reason.

        """
        of = self._of
        now_ns, journal = of.ros_time_ns, of.source.journal()
        if now_ns is None or not journal.journal_id:
            return
        if unix_s(now_ns) is None:
            raise PastRefused("the time is simulated, and has no time of day")
        newest_ns = self._ended_ns(now_ns)
        if not 0 < self._sent_ns <= newest_ns:  # none yet, or the clock was ahead
            self._sent_ns = self._ended_ns(newest_ns, -1)
        due_ns = self._ended_ns(self._sent_ns, 1)
        if due_ns > newest_ns:
            return
        complete_ns = journal.complete_ns or 0
        if complete_ns < due_ns and now_ns < due_ns + LATE_NS:
            return
        report = Report(self._ended_ns(due_ns, -1), due_ns, of.criteria, journal)
        try:
            await self._send(report)
        except PastRefused as error:
            if now_ns < due_ns + LATE_NS:
                raise
            # It would be refused for ever, and hold up the days after it.
            log.error("the report up to %s is skipped: %s", compact(due_ns), error)  # noqa: TRY400
        self._sent_ns = due_ns

    async def _send(self, report: Report) -> None:
        found = await self._of.source.ask(partial(answered, report, ""), REPORT_S)
        assert found.answer is not None  # no ETag was given
        body, until = orjson.Fragment(found.answer.body), compact(report.end_ns)
        if not await self._channel.deliver(f"report.{until}", body):
            log.error("the report up to %s was given up by %s", until, self._channel.name)


# --- all channels together ------------------------------------------------------------------------


class DetachedThreads(ThreadPoolExecutor):
    """A thread pool whose work is not waited for at the end.

    A name server that does not answer blocks a thread for half a minute, and asyncio would wait for
    it at its end. These threads are left behind, and end with the process (`runtime.process`).
    """

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:  # noqa: ARG002
        """End the idle threads, and wait for none."""
        super().shutdown(wait=False, cancel_futures=True)


class Channels:
    """The channels that the operator has set up. Belongs to the event loop."""

    def __init__(self, targets: Targets | None = None, push: Push | None = None) -> None:
        self._targets, self.push = targets or Targets(), push
        self._running: list[Mqtt | Webhook | Push] = []
        self._reports: list[DailyReport] = []

    def start(self, source: Source, sensors: Sensors) -> None:
        """Start the channels and the reports."""
        targets = self._targets
        reporting: list[Mqtt | Webhook] = []
        if targets.mqtt is not None:
            reporting.append(Mqtt(targets.mqtt, Mirror(targets.mqtt.topics, sensors)))
        if targets.webhook is not None:
            reporting.append(Webhook(targets.webhook))
        self._running += reporting
        if self.push is not None:
            self._running.append(self.push)
        if self._running:
            asyncio.get_running_loop().set_default_executor(
                DetachedThreads(thread_name_prefix="notify")
            )
        for channel in self._running:
            channel.start(source)
        if targets.report_at is not None:
            self._reports = [DailyReport(targets.report_at, it, source) for it in reporting]
        for report in self._reports:
            report.start()

    def on_alarms(self, change: Change) -> None:
        """Pass on changed alarms to all channels but MQTT, which polls the state."""
        for channel in self._running:
            if isinstance(channel, Mqtt):
                continue
            try:
                channel.on_alarms(change)
            except Exception:  # whatever it is: the page and the other channels get them
                log.exception("%s had an error with changed alarms", channel.name)

    async def stop(self) -> None:
        """Stop all of them concurrently."""
        await asyncio.gather(*(it.stop() for it in (*self._reports, *self._running)))

    def status(self) -> Mapping[str, str]:
        """By channel, what is wrong with it, in one line; empty: nothing."""
        return {it.name: it.condition.detail for it in self._running}

    def counts(self) -> Iterator[tuple[str, Mapping[str, int]]]:
        """Yield each metric with its values by channel."""
        for name in ("is_connected", "waiting", "sent", "failed", "dropped"):
            values = {it.name: int(getattr(it.condition, name)) for it in self._running}
            yield f"lupin_outward_{name.removeprefix('is_')}", values
