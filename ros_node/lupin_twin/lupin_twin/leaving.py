"""A command from its first moment to its end, also where a computation is on its hands then.

Standard library alone.
"""

from __future__ import annotations

import logging
import os
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
