"""The end of a process that may have a computation on its hands. Standard library alone."""

from __future__ import annotations

import logging
import os
import sys
import threading
import time
from collections.abc import Callable
from typing import Final, NoReturn

# An idle worker ends at once when it is told to; who takes longer is at work.
IDLE_WORKERS_END_S: Final = 0.1


def leave_after(main: Callable[[], int]) -> NoReturn:
    """Run `main` and `leave` with what it returns, and in the same way where it raises.

    As Python puts itself away, no thread may be within SQLite or a disk that hangs.
    """
    try:
        code = main()
    except SystemExit as ended:
        if isinstance(ended.code, str):
            sys.stderr.write(f"{ended.code}\n")
        code = ended.code if isinstance(ended.code, int) else int(ended.code is not None)
    except BaseException as error:  # noqa: BLE001  # as Python itself would end
        sys.excepthook(type(error), error, error.__traceback__)
        code = 1
    leave(code)


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
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
    sys.exit(code)
