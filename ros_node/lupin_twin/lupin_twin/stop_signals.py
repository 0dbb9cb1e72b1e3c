"""Ctrl-C and SIGTERM are waited for, never handled asynchronously: neither ends in a traceback.

Standard library alone, so that a command can call `block` before it imports anything slow.
"""

from __future__ import annotations

import signal
from typing import Final

STOP_SIGNALS: Final = frozenset({signal.SIGINT, signal.SIGTERM})


def block() -> None:
    """Hold the stop signals back until `wait` asks for them.

    To be called first of all, before ROS starts its threads: they inherit this.
    """
    signal.pthread_sigmask(signal.SIG_BLOCK, STOP_SIGNALS)


def wait() -> None:
    """Return when a stop signal has come.

    Not by sigtimedwait: after a SIGSTOP and a SIGCONT, CPython returns from it without a signal.
    """
    signal.sigwait(STOP_SIGNALS)
