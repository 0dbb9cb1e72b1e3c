"""Where `lupin-twin journal` writes to: the standard output, a file that is new, a special one."""

from __future__ import annotations

import os
import re
import sqlite3
import stat
import sys
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import Final

from lupin_twin.process import lead_nowhere

# Of these two, only the copy is written.
_NOT_WRITTEN: Final = {
    sqlite3.SQLITE_FULL,
    sqlite3.SQLITE_IOERR_WRITE,
    sqlite3.SQLITE_IOERR_FSYNC,
    sqlite3.SQLITE_IOERR_TRUNCATE,
}
# So that Ctrl-C is heard in between.
_PAGES_AT_ONCE: Final = 1000


def backup(journal: sqlite3.Connection, target: Path, tell: Callable[[float], None]) -> int:
    """Copy it to a new file by SQLite's own online backup; returns the file's size, bytes.

    `tell` is told the share that is copied.

    Raises:
        CannotWrite: there is such a file, or it cannot be made or written.
        sqlite3.Error: the journal cannot be read.

    """
    # Without a transaction, each write of the twin would have SQLite begin the copy anew.
    journal.execute("BEGIN")
    journal.execute("SELECT count(*) FROM sqlite_schema").fetchone()
    try:
        target.open("xb").close()
    except FileExistsError as error:
        raise CannotWrite(f"{target} is there already, and nothing is overwritten") from error
    except OSError as error:
        raise CannotWrite(f"cannot write {target}: {error.strerror}") from error
    try:
        with closing(sqlite3.connect(target)) as copy:
            journal.backup(
                copy,
                pages=_PAGES_AT_ONCE,
                progress=lambda _, rest, total: tell(1 - rest / max(total, 1)),
            )
    except BaseException as error:
        # Half of a copy looks like all of it.
        target.unlink()
        if getattr(error, "sqlite_errorcode", None) in _NOT_WRITTEN:
            raise CannotWrite(f"cannot write {target}: {error}") from error
        raise
    return target.stat().st_size


Write = Callable[[bytes], object]

# What the shell has opened already: for its name the system would open the file behind it anew.
_DESCRIPTOR: Final = re.compile(r"/dev/(stdout|stderr)|(?:/dev|/proc/self)/fd/([0-9]{1,6})")
_NUMBERS: Final = {"stdout": 1, "stderr": 2}
# What SQLite, the lock and vacuum keep beside a journal, be it there now or not.
_BESIDE: Final = ("", "-wal", "-shm", "-journal", ".lock", ".vacuum")


class CannotWrite(Exception):
    """What was asked for has nowhere to go; the message is the one line that says why."""


def standard(data: bytes) -> None:
    """Write to the standard output, at once.

    Raises:
        CannotWrite: it does not take it.
        BrokenPipeError: who read it has gone.

    """
    try:
        sys.stdout.buffer.write(data)
        sys.stdout.buffer.flush()
    except OSError as error:
        lead_nowhere(sys.stdout)
        if isinstance(error, BrokenPipeError):
            raise
        raise CannotWrite(f"cannot write to the standard output: {error.strerror}") from error


@contextmanager
def writing(target: str, journal: Path) -> Iterator[Write]:
    """Write bytes to a file that was not there, and is not there where anything goes wrong.

    A device, a FIFO and what the shell has opened (`/dev/stdout`) are written as they are.

    Raises:
        CannotWrite: there is such a file, it is one of the journal's own, or the disk is full.
        BrokenPipeError: who read it has gone.

    """
    if os.path.realpath(target) in _own_files(journal):
        raise CannotWrite(f"{target} is a file of the journal itself, and nothing is overwritten")
    with _told(target):
        descriptor, is_new = _open(target)

    def write(data: bytes) -> None:
        rest = memoryview(data)
        while rest:
            with _told(target):
                rest = rest[os.write(descriptor, rest) :]

    try:
        try:
            yield write
        finally:
            with _told(target):
                os.close(descriptor)
    except BaseException:
        # Half of an export looks like all of it.
        if is_new:
            with suppress(OSError):
                Path(target).unlink()
        raise


def _open(target: str) -> tuple[int, bool]:
    """Its descriptor, and whether the file was made here."""
    opened = _DESCRIPTOR.fullmatch(target)
    if opened:
        name, number = opened.groups()
        return os.dup(_NUMBERS[name] if name else int(number)), False
    try:
        new = os.open(target, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o666)
    except FileExistsError:
        if not _is_special(target):
            raise
        return os.open(target, os.O_WRONLY | os.O_CLOEXEC), False
    return new, True


def _is_special(target: str) -> bool:
    """Whether it is neither a regular file nor a link to nothing."""
    try:
        return not stat.S_ISREG(Path(target).stat().st_mode)
    except FileNotFoundError:
        return False


def _own_files(journal: Path) -> set[str]:
    names = {str(journal), os.path.realpath(journal)}
    return {os.path.realpath(name + end) for name in names for end in _BESIDE}


@contextmanager
def _told(target: str) -> Iterator[None]:
    try:
        yield
    except BrokenPipeError:
        raise
    except FileExistsError as error:
        raise CannotWrite(f"{target} is there already, and nothing is overwritten") from error
    except OSError as error:
        raise CannotWrite(f"cannot write {target}: {error.strerror}") from error
