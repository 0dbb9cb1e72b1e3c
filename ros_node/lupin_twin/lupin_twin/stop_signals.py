"""Ctrl-C and SIGTERM are waited for, never handled asynchronously: neither ends in a traceback.

Standard library alone, so that a command can call `block` before it imports anything slow.
"""

from __future__ import annotations

import ctypes
import faulthandler
import os
import signal
import sys
from typing import Final

STOP_SIGNALS: Final = frozenset({signal.SIGINT, signal.SIGTERM})

# So long an end may take, s, whatever hangs: five times as long as it is meant to.
END_S: Final = 10
_STDERR: Final = 2
_PR_SET_PDEATHSIG: Final = 1


def block() -> None:
    """Hold the stop signals back until `wait` asks for them.

    To be called first of all, before ROS starts its threads: they inherit this.
    """
    signal.pthread_sigmask(signal.SIG_BLOCK, STOP_SIGNALS)


def wait(end_within_s: int = END_S) -> None:
    """Return when a stop signal has come; from then on the process has to end (`must_end`).

    Not by sigtimedwait: after a SIGSTOP and a SIGCONT, CPython returns from it without a signal.
    """
    signal.sigwait(STOP_SIGNALS)
    must_end(end_within_s)


def must_end(within_s: int = END_S) -> None:
    """From now on the process ends within so long, even if the middleware never comes back.

    Where every thread was is told then. Neither of the two needs the interpreter: a call that hangs
    may keep it. The second is there for what runs after Python has ended.
    """
    faulthandler.dump_traceback_later(within_s, exit=True, file=_STDERR)
    signal.alarm(within_s + 1)


def end_with_parent() -> None:
    """Have the kernel send SIGTERM when the process that started this one is gone (prctl(2))."""
    parent = os.getppid()
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
    if os.getppid() != parent:  # it went before the kernel was asked
        sys.exit(0)
