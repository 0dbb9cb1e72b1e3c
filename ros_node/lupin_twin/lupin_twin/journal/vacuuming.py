"""Making a journal as small as what is in it, while no twin has it.

A copy without gaps is written beside the file, synced, and takes its name: whatever happens
meanwhile, one of the two is whole. It takes as much room as the copy does, for as long as it takes.
"""

from __future__ import annotations

import os
import shutil
import sqlite3
import threading
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Final

from lupin_twin.journal.lock import Lock
from lupin_twin.journal.retention import used_bytes
from lupin_twin.journal.schema import open_writer, sync_folder

_TELL_EVERY_S: Final = 0.5
_INSTRUCTIONS: Final = 100_000
# The copy and as much as the file system itself takes for it.
_ROOM: Final = 1.02


class NotPossible(Exception):
    """It cannot be made smaller now; the message says why. The file is as it was."""


def vacuum(path: Path, holder: str, tell: Callable[[float], None]) -> tuple[int, int]:
    """Make the file small; returns its bytes before and after.

    `tell(share)` is called twice a second in a thread of its own.

    Raises:
        InUse: a twin has it.
        NotPossible: no room on its disk, or somebody reads it.
        Foreign, sqlite3.Error, OSError: as `open_writer`.

    """
    copy = path.with_name(path.name + ".vacuum")
    with Lock(path, holder):
        before = path.stat().st_size
        try:
            _copy(path, copy, tell)
            copy.chmod(path.stat().st_mode & 0o777)
            with closing(open_writer(copy)) as connection:
                connection.execute("SELECT count(*) FROM scan").fetchone()
            _sync(copy)
            copy.replace(path)
            sync_folder(path.parent)
        except BaseException:
            copy.unlink(missing_ok=True)
            raise
        return before, path.stat().st_size


def hear_interrupts(connection: sqlite3.Connection) -> None:
    """Have Ctrl-C end what takes SQLite minutes: Python hears it only in Python."""
    connection.set_progress_handler(lambda: 0, _INSTRUCTIONS)


def _copy(path: Path, copy: Path, tell: Callable[[float], None]) -> None:
    with closing(open_writer(path)) as connection:
        hear_interrupts(connection)
        # Without a log nobody who comes later finds one that is not of the new file. SQLite does
        # this alone when nobody else has the file open.
        try:
            connection.execute("PRAGMA busy_timeout = 0")
            (mode,) = connection.execute("PRAGMA journal_mode = DELETE").fetchone()
        except sqlite3.OperationalError:
            mode = "locked"
        if mode != "delete":
            raise NotPossible(f"somebody reads {path}: try again when nobody does")
        needed = int(used_bytes(connection) * _ROOM)
        free = shutil.disk_usage(path.parent).free
        if free < needed:
            raise NotPossible(
                f"the disk of {path} has {free / 1e6:.1f} MB free, and a copy of what is in it"
                f" takes {needed / 1e6:.1f} MB"
            )
        copy.unlink(missing_ok=True)
        done = threading.Event()

        def watch() -> None:
            while not done.wait(_TELL_EVERY_S):
                if copy.exists():
                    tell(min(1.0, copy.stat().st_size / needed))

        watching = threading.Thread(target=watch, name="vacuum", daemon=True)
        watching.start()
        try:
            connection.execute("VACUUM INTO ?", (str(copy),))
        finally:
            done.set()
            watching.join()


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
