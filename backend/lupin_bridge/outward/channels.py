"""All channels together, for the bridge: started, watched and stopped with it."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import Protocol

from lupin_bridge.alarms.board import AlarmBoard
from lupin_bridge.judge.ranges import Sensors
from lupin_bridge.outward.choosing import Targets
from lupin_bridge.outward.mirror import Mirror
from lupin_bridge.outward.mqtt import Mqtt
from lupin_bridge.outward.payloads import Seen
from lupin_bridge.outward.webhook import Webhook
from lupin_bridge.stream.status import Outward
from lupin_twin.diagnostics import Origin


class LeftAlone(ThreadPoolExecutor):
    """Threads whose work is not waited for at the end.

    A name server that does not answer holds a thread for half a minute, and asyncio waits for all
    of them as it ends. Here it goes on; what is left ends with the process (`lupin_twin.process`).
    """

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:  # noqa: ARG002
        """End the idle threads, and wait for none."""
        super().shutdown(wait=False, cancel_futures=True)


class House(Protocol):
    """What the channels need of the bridge."""

    alarms: AlarmBoard

    def seen(self) -> Seen:
        """How the house is now."""

    @property
    def ros_time_ns(self) -> int | None:
        """ROS time now; None: it is not known."""

    @property
    def origin(self) -> Origin:
        """Where observations come from."""


class Channels:
    """Those that the operator wants. They look at the house by themselves: nobody waits for them.

    Belongs to the event loop.
    """

    def __init__(self, targets: Targets | None = None) -> None:
        self._targets = targets or Targets()
        self._mqtt: Mqtt | None = None
        self._webhook: Webhook | None = None

    def start(self, house: House, sensors: Sensors) -> None:
        """Begin to tell of a house."""
        targets = self._targets
        if targets.mqtt is None and targets.webhook is None:
            return
        asyncio.get_running_loop().set_default_executor(LeftAlone(thread_name_prefix="outward"))
        if targets.mqtt is not None:
            self._mqtt = Mqtt(targets.mqtt, Mirror(targets.mqtt.topics, sensors))
            self._mqtt.start(house.seen)
        if targets.webhook is not None:
            self._webhook = Webhook(targets.webhook)
            self._webhook.start(house.alarms, lambda: house.ros_time_ns, lambda: house.origin)

    async def stop(self) -> None:
        """Stop all at once."""
        await asyncio.gather(*(channel.stop() for channel in self._running))

    def status(self) -> tuple[Outward, ...]:
        """How each of them does, in a line."""
        return tuple(
            Outward(it.name, bool(it.condition.detail), it.condition.detail) for it in self._running
        )

    def counts(self) -> Iterator[tuple[str, Mapping[str, int]]]:
        """The same in numbers, by metric and channel."""
        conditions = {it.name: it.condition for it in self._running}
        yield "lupin_outward_connected", {k: int(it.is_connected) for k, it in conditions.items()}
        yield "lupin_outward_waiting", {k: it.waiting for k, it in conditions.items()}
        yield "lupin_outward_sent", {k: it.sent for k, it in conditions.items()}
        yield "lupin_outward_failed", {k: it.failed for k, it in conditions.items()}
        yield "lupin_outward_dropped", {k: it.dropped for k, it in conditions.items()}

    @property
    def _running(self) -> tuple[Mqtt | Webhook, ...]:
        return tuple(it for it in (self._mqtt, self._webhook) if it is not None)
