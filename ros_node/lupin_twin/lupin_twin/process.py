"""How a process begins and ends: its threads for BLAS, its stop signals, its last moments.

Ctrl-C and SIGTERM are waited for, never handled asynchronously: neither ends in a traceback.
Standard library alone, so that a command can call `block` before it imports anything slow.
"""

from __future__ import annotations

import ctypes
import faulthandler
import logging
import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Final, NoReturn, TextIO

# An idle worker ends at once when it is told to; who takes longer is at work.
IDLE_WORKERS_END_S: Final = 0.1
# What a shell says of a command that Ctrl-C has ended: 128 and the signal's number.
INTERRUPTED: Final = 130
# What Python says where the last of the standard output could not be written.
NOT_WRITTEN: Final = 120


def leave_after(main: Callable[[], int]) -> NoReturn:
    """Run `main` and `leave` with what it returns, and in the same way where it raises.

    As Python puts itself away, no thread may be within SQLite or a disk that hangs. Ctrl-C ends it
    quietly, also before `main` asks for it: what it imports takes its time.
    """
    try:
        open_standard_files()
        code = main()
    except KeyboardInterrupt:
        code = INTERRUPTED
    except SystemExit as ended:
        if isinstance(ended.code, str):
            with suppress(OSError):
                sys.stderr.write(f"{ended.code}\n")
        code = ended.code if isinstance(ended.code, int) else int(ended.code is not None)
    except BaseException as error:  # noqa: BLE001  # as Python itself would end
        sys.excepthook(type(error), error, error.__traceback__)
        code = 1
    leave(code)


def open_standard_files() -> None:
    """Open /dev/null for each of the three that whoever started this process has closed.

    The next file that is opened would get its number, and whatever a library in C prints would be
    written into it. Python has None for it, and `sys.stderr.write` would raise.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            # The lowest number that is free: this one. Children are to have it too.
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: PTH123, SIM115


def leave(code: int) -> NoReturn:
    """End the process, whatever its other threads are computing.

    Python waits at its end for every worker of a pool, daemon or not, and numpy cannot be
    interrupted: a large field would hold up Ctrl-C for as long as it takes. So where, and only
    where, a thread is still at work, the process ends without Python's (and DDS's) tidying up.
    """
    deadline_s = time.monotonic() + IDLE_WORKERS_END_S
    others = [thread for thread in threading.enumerate() if thread is not threading.main_thread()]
    for thread in others:
        thread.join(max(0.0, deadline_s - time.monotonic()))
    if any(thread.is_alive() for thread in others):
        logging.shutdown()
        os._exit(_flushed(code))
    sys.exit(_flushed(code))


def _flushed(code: int) -> int:
    """Write what still waits to be; the exit code then.

    Where the standard output fails, that is told. That the standard error does is no failure of
    the command: Python itself would take it for one, and finds nothing to write any more.
    """
    try:
        sys.stdout.flush()
    except OSError as error:
        lead_nowhere(sys.stdout)
        if code == 0:
            code = NOT_WRITTEN
            with suppress(OSError):
                sys.stderr.write(f"cannot write to the standard output: {error.strerror}\n")
    try:
        sys.stderr.flush()
    except OSError:
        lead_nowhere(sys.stderr)
    return code


def lead_nowhere(stream: TextIO) -> None:
    """Have /dev/null take what a stream could not write, and will try again."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, stream.fileno())
    os.close(nowhere)


_VARIABLE: Final = "OPENBLAS_NUM_THREADS"


def use_one_core() -> None:
    """Have OpenBLAS start no threads, in this process and its children, unless somebody said so."""
    os.environ.setdefault(_VARIABLE, "1")


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
