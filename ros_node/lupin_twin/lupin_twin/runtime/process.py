"""How a process starts and ends: BLAS threads, stop signals, exit, and stale DDS shared memory.

Ctrl-C and SIGTERM are waited for, never handled asynchronously: neither ends in a traceback.
Standard library alone, so that a command can call `block` before it imports anything slow.

Stale shared memory of Fast DDS blocks every later start in its domain forever. A process that is
killed while it creates the memory of a port leaves it marked as unfinished. The next one that opens
it waits in C++ and holds the GIL: there is no node, no log line, no signal handler
(https://github.com/eProsima/Fast-DDS/issues/1144). So it is removed before a node is made.
"""

from __future__ import annotations

import ctypes
import faulthandler
import logging
import os
import signal
import stat
import struct
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Final, NoReturn, TextIO

# An idle worker ends at once when it is closed; one that takes longer, s, is at work.
IDLE_WORKERS_END_S: Final = 0.1
# Exit code of a command that Ctrl-C has ended, as in a shell: 128 and the signal's number.
INTERRUPTED: Final = 130
# Exit code for invalid arguments.
USAGE_ERROR: Final = 2


def exit_after(main: Callable[[], int]) -> NoReturn:
    """Run `main`, and `exit_process` with the code that it returns; also if it raises.

    While Python shuts down, no thread may be in SQLite, or wait for a disk that hangs. Ctrl-C ends
    the process quietly, also during slow imports, before `main` waits for it.
    """
    try:
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
    exit_process(code)


def refuse(command: str, reason: str) -> int:
    """Print in one line why a command does not start; returns the exit code."""
    sys.stderr.write(f"{command}: {' '.join(reason.split())}\n")
    return USAGE_ERROR


def split_ros_args(argv: Sequence[str]) -> tuple[list[str], list[str]]:
    """Our own arguments, and ROS's: from `--ros-args` to `--` or the end, as ROS defines it."""
    own: list[str] = []
    ros: list[str] = []
    in_ros = False
    for argument in argv:
        if argument == "--ros-args":
            in_ros = True
        elif in_ros and argument == "--":
            ros.append(argument)
            in_ros = False
            continue
        (ros if in_ros else own).append(argument)
    return own, ros


def exit_process(code: int) -> NoReturn:
    """End the process, whatever its other threads are computing.

    Python waits at its end for every worker of a pool, daemon or not, and numpy cannot be
    interrupted. A large field would delay Ctrl-C for as long as it takes. So if, and only if, a
    thread is still at work, the process ends without the cleanup of Python and DDS.
    """
    deadline_s = time.monotonic() + IDLE_WORKERS_END_S
    others = [thread for thread in threading.enumerate() if thread is not threading.main_thread()]
    for thread in others:
        thread.join(max(0.0, deadline_s - time.monotonic()))
    if any(thread.is_alive() for thread in others):
        logging.shutdown()
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError):
                stream.flush()
        os._exit(code)
    sys.exit(code)


def discard_output(stream: TextIO) -> None:
    """Redirect a stream to /dev/null, because Python will retry what it could not write."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, stream.fileno())
    os.close(nowhere)


_VARIABLE: Final = "OPENBLAS_NUM_THREADS"


def limit_blas_threads() -> None:
    """Keep OpenBLAS from starting threads, here and in children, unless the environment asks."""
    os.environ.setdefault(_VARIABLE, "1")


# malloc.h of glibc.
_M_MMAP_THRESHOLD: Final = -3
_M_ARENA_MAX: Final = -8
_LARGE_BYTES: Final = 1_000_000
_HEAPS: Final = 2


def return_large_blocks() -> None:
    """Make glibc return the memory of a large array to the system as soon as it is freed.

    By default it ends up keeping blocks of up to 32 MB: an estimate left 50 MB behind. And nearly
    each thread has a heap of its own, which keeps what it once needed: 11 MB.
    """
    with suppress(AttributeError, OSError):  # another C library
        mallopt = ctypes.CDLL(None).mallopt
        mallopt(_M_MMAP_THRESHOLD, _LARGE_BYTES)
        mallopt(_M_ARENA_MAX, _HEAPS)


STOP_SIGNALS: Final = frozenset({signal.SIGINT, signal.SIGTERM})

# How long shutdown may take, s, whatever hangs: five times as long as intended.
END_S: Final = 10
_STDERR: Final = 2
_PR_SET_PDEATHSIG: Final = 1


def block() -> None:
    """Block the stop signals until `wait` takes them.

    To be called first of all, before ROS starts its threads: they inherit this.
    """
    signal.pthread_sigmask(signal.SIG_BLOCK, STOP_SIGNALS)


def wait(end_within_s: int = END_S) -> None:
    """Return when a stop signal has come; then the process has to end (`set_exit_deadline`).

    Not by sigtimedwait: after a SIGSTOP and a SIGCONT, CPython returns from it without a signal.
    """
    signal.sigwait(STOP_SIGNALS)
    set_exit_deadline(end_within_s)


def stop_flag() -> threading.Event:
    """Return a flag that a stop signal sets; call `block` before. Then the process has to end."""
    flag = threading.Event()

    def note() -> None:
        wait()
        flag.set()

    threading.Thread(target=note, name="signals", daemon=True).start()
    return flag


def set_exit_deadline(within_s: int = END_S) -> None:
    """End the process within `within_s` from now, even if the middleware hangs.

    In that case the traceback of every thread is printed. Neither of the two timers needs the
    interpreter, which a hanging call may hold. The second covers what runs after Python has ended.
    """
    faulthandler.dump_traceback_later(within_s, exit=True, file=_STDERR)
    signal.alarm(within_s + 1)


def end_with_parent() -> None:
    """Have the kernel send SIGTERM when the process that started this one is gone (prctl(2))."""
    parent = os.getppid()
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
    if os.getppid() != parent:  # it ended before the call
        sys.exit(0)


FOLDER: Final = Path("/dev/shm")  # noqa: S108  # where Linux keeps shared memory
# Younger files, s, may still be in creation, which takes milliseconds.
YOUNG_S: Final = 5.0
# The RTPS specification's default port numbers, 9.6.1.1: where a domain's begin, and how many.
_PORT_BASE: Final = 7400
_PORTS_PER_DOMAIN: Final = 250
# The first word of a managed segment of Boost.Interprocess: not begun, being made, made, corrupted.
_STATE: Final = struct.Struct("=I")
_MADE: Final = 2

log = logging.getLogger(__name__)


def ports(domain: int) -> range:
    """The ports of a ROS domain."""
    first = _PORT_BASE + _PORTS_PER_DOMAIN * domain
    return range(first, first + _PORTS_PER_DOMAIN)


def remove_stale_shared_memory(domain: int, folder: Path = FOLDER) -> list[str]:
    """Remove a domain's ports that killed processes left unfinished; returns the file names.

    A file that cannot be removed, because it is another user's, is logged as an error: the start
    may hang on it.
    """
    removed = []
    for path in _unfinished(domain, folder):
        try:
            path.unlink()
        except FileNotFoundError:
            continue
        except OSError as error:
            log.error(  # noqa: TRY400  # the line says it all
                "%s was left unfinished by a killed process and cannot be removed (%s): if the "
                "start hangs now, remove it, or set FASTDDS_BUILTIN_TRANSPORTS=UDPv4",
                path,
                error.strerror,
            )
            continue
        log.warning("removed %s, left unfinished by a killed process", path)
        removed.append(path.name)
    return removed


def _unfinished(domain: int, folder: Path) -> Iterator[Path]:
    for port in ports(domain):
        path = folder / f"fastrtps_port{port}"
        try:
            file = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
        except OSError:
            continue
        try:
            about = os.fstat(file)
            is_old = time.time() - about.st_mtime > YOUNG_S
            if stat.S_ISREG(about.st_mode) and is_old and not _is_built(os.read(file, _STATE.size)):
                yield path
        finally:
            os.close(file)


def _is_built(begin: bytes) -> bool:
    return len(begin) == _STATE.size and _STATE.unpack(begin)[0] >= _MADE
