"""Making a journal as small as what is in it, while no twin has it.

A copy without gaps is written beside the file, synced, and takes its name: whatever happens
meanwhile, one of the two is whole. It takes as much room as the copy does, for as long as it takes.
"""

from __future__ import annotations

import os
import shutil
import sqlite3
import threading
from contextlib import closing
from pathlib import Path
from typing import Final

from lupin_twin.journal.checking import Progress, find_all_damage
from lupin_twin.journal.lock import Lock
from lupin_twin.journal.retention import used_bytes
from lupin_twin.journal.schema import open_named, open_writer, sync_folder

_TELL_EVERY_S: Final = 0.5
_INSTRUCTIONS: Final = 100_000
# The copy and as much as the file system itself takes for it.
_ROOM: Final = 1.02


class NotPossible(Exception):
    """It cannot be made smaller now; the message says why. The file is as it was."""


def vacuum(path: Path, holder: str, tell: Progress) -> tuple[int, int]:
    """Make the file small; returns its bytes before and after.

    All of it is read for damage first: a copy without gaps would have lost what is still to be
    saved of a damaged one. `tell(what, share)` is called as the work goes on, of the copying twice
    a second in a thread of its own.

    Raises:
        InUse: a twin has it.
        NotPossible: it is damaged, no room on its disk, or somebody reads it.
        Empty, Foreign, DamagedFile, sqlite3.Error, OSError: as `open_named`.

    """
    # Not a thing is made beside a file that is no journal.
    with closing(open_named(path)):
        pass
    copy = path.with_name(path.name + ".vacuum")
    with Lock(path, holder):
        _refuse_damaged(path, tell)
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


def _refuse_damaged(path: Path, tell: Progress) -> None:
    with closing(open_named(path)) as connection:
        hear_interrupts(connection)
        with closing(find_all_damage(connection, tell)) as found:
            first = next(found, None)
    if first is not None:
        raise NotPossible(
            f"{path} is damaged and left as it is ({first});"
            " lupin-twin journal check tells all that is"
        )


def _copy(path: Path, copy: Path, tell: Progress) -> None:
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
                    tell("copying", min(1.0, copy.stat().st_size / needed))

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
