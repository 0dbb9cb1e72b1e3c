"""Ctrl-C and SIGTERM are waited for, never handled asynchronously: neither ends in a traceback.

Standard library alone, so that a command can call `block` before it imports anything slow.
"""

from __future__ import annotations

import ctypes
import faulthandler
import os
import signal
import sys
from collections.abc import Set as AbstractSet
from typing import Final

STOP_SIGNALS: Final = frozenset({signal.SIGINT, signal.SIGTERM})

# So long an end may take, s, whatever hangs: five times as long as it is meant to.
END_S: Final = 10
_STDERR: Final = 2
_PR_SET_PDEATHSIG: Final = 1


def with_hang_up() -> frozenset[signal.Signals]:
    """The stop signals and SIGHUP: the terminal was closed. Not under nohup, which ignores it."""
    is_ignored = signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    return STOP_SIGNALS if is_ignored else STOP_SIGNALS | {signal.SIGHUP}


def block(signals: AbstractSet[signal.Signals] = STOP_SIGNALS) -> None:
    """Hold the stop signals back until `wait` asks for them.

    To be called first of all, before ROS starts its threads: they inherit this.
    """
    signal.pthread_sigmask(signal.SIG_BLOCK, signals)


def wait(end_within_s: int = END_S, signals: AbstractSet[signal.Signals] = STOP_SIGNALS) -> None:
    """Return when a stop signal has come; from then on the process has to end (`must_end`).

    Not by sigtimedwait: after a SIGSTOP and a SIGCONT, CPython returns from it without a signal.
    """
    signal.sigwait(signals)
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
