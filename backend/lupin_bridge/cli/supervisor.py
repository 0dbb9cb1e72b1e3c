"""What the service manager is told; apart from the roles, for `fleet` runs without ROS."""

from __future__ import annotations

import asyncio
import logging
import os
import socket
from collections.abc import Callable, MutableMapping
from typing import Final

log = logging.getLogger(__name__)

# The manager acts when nothing has come for the whole time: two messages may be lost.
_MESSAGES_A_TIMEOUT: Final = 3


class Supervisor:
    """systemd's notifications (sd_notify(3)); none where NOTIFY_SOCKET is not set.

    The variables are taken out of `environment`: a child must not speak for this process.
    """

    def __init__(self, environment: MutableMapping[str, str]) -> None:
        address = environment.pop("NOTIFY_SOCKET", "")
        timeout_us = environment.pop("WATCHDOG_USEC", "")
        process = environment.pop("WATCHDOG_PID", "")
        # "@": Linux's abstract namespace, whose names begin with a zero.
        self._address = f"\0{address[1:]}" if address.startswith("@") else address
        self._socket: socket.socket | None = None
        if address.startswith(("/", "@")):
            self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC)
            self._socket.setblocking(False)
        elif address:
            log.warning("NOTIFY_SOCKET is %r, expected a path or @name: no notifications", address)
        is_ours = process in ("", str(os.getpid()))
        self.watchdog_s: Final = (
            int(timeout_us) / 1e6 if is_ours and timeout_us.isdecimal() else 0.0
        )
        self._has_failed = False

    def ready(self, status: str) -> None:
        """It serves from now on; `status` is a line for people."""
        self._notify(f"READY=1\nSTATUS={status}")

    def stopping(self) -> None:
        """It is about to end."""
        self._notify("STOPPING=1")

    async def send_watchdog(self, ailment: Callable[[], str | None]) -> None:
        """Notify that all is well, as long as `ailment` finds nothing."""
        while self.watchdog_s > 0.0:
            wrong = ailment()
            self._notify("WATCHDOG=1" if wrong is None else f"STATUS={wrong}")
            await asyncio.sleep(self.watchdog_s / _MESSAGES_A_TIMEOUT)

    def close(self) -> None:
        """Notify no more."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def _notify(self, words: str) -> None:
        if self._socket is None:
            return
        try:
            self._socket.sendto(words.encode(), self._address)
        except OSError as error:
            if not self._has_failed:
                log.warning(
                    "the service manager cannot be notified of %r: %s", words, error.strerror
                )
            self._has_failed = True
