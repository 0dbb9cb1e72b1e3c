"""Asks a source what the robot says of itself, once a second, and tells the listeners of it."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from typing import Final

from lupin_bridge.feed.robot import RobotLog
from lupin_bridge.feed.source import TwinSource, TwinUnavailableError
from lupin_bridge.stream.hub import Hub
from lupin_bridge.stream.robot_json import robot_frame

log = logging.getLogger(__name__)

# How often the newest message of each topic is taken: no frame comes more often.
PERIOD_S: Final = 1.0


class RobotFollower:
    """Keeps what is known of the robot; a frame goes out when anything is another.

    `now_ns()` is the twin's time, None: not known; `clock` tells seconds and never jumps. Belongs
    to the event loop.
    """

    def __init__(
        self,
        source: TwinSource,
        hub: Hub,
        now_ns: Callable[[], int | None],
        clock: Callable[[], float],
    ) -> None:
        self.log = RobotLog()
        self._source = source
        self._hub = hub
        self._now_ns = now_ns
        self._clock = clock
        self._task: asyncio.Task[None] | None = None

    def start(self) -> None:
        """Begin."""
        self._task = asyncio.create_task(self._follow(), name="robot")

    async def stop(self) -> None:
        """End."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.wait((self._task,))

    async def _follow(self) -> None:
        while True:
            await asyncio.sleep(PERIOD_S)
            now_ns = self._now_ns()
            try:
                heard = await self._source.robot(now_ns)
                if heard is None:
                    return
                if self.log.take(heard, now_ns):
                    self._hub.publish_robot(robot_frame(self.log.now), self._clock())
            except TwinUnavailableError:  # its thread has ended, which others tell
                return
            except Exception:  # nobody waits for this task, and it goes on
                log.exception("what the robot says of itself could not be taken")
