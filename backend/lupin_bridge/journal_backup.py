"""A copy of a journal as of one moment, while its twin goes on writing."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Final

from lupin_bridge.journal_output import CannotWrite

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
