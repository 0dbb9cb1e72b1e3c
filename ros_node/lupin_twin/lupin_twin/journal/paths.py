"""A journal's path, and the files beside it: the lock, the archive's mark, the WAL to be synced."""

from __future__ import annotations

import fcntl
import os
import re
import sqlite3
import threading
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Final

from lupin_twin.journal.schema import open_named, open_writer, sync

NO_JOURNAL: Final = "off"


def journal_path(
    given: str, environ: Mapping[str, str], domain: int, namespace: str
) -> Path | None:
    """Return the journal's path; None if it is off.

    By default it is a file in the user's state folder, named by domain and namespace.

    Raises:
        RuntimeError: there is no home directory.

    """
    if given == NO_JOURNAL:
        return None
    if given:
        return Path(given).expanduser().absolute()
    names = [f"domain-{domain}", *re.findall("[^/]+", namespace)]
    return state_folder(environ) / f"{'.'.join(names)}.sqlite"


def demo_journal_path(environ: Mapping[str, str], seed: int) -> Path:
    """Return the path of a demo's journal: apart from a real twin's, and one for each seed.

    Raises:
        RuntimeError: there is no home directory.

    """
    return state_folder(environ) / f"demo-seed-{seed}.sqlite"


def state_folder(environ: Mapping[str, str]) -> Path:
    """The user's folder for persistent state (XDG Base Directory Specification).

    Raises:
        RuntimeError: there is no home directory.

    """
    given = Path(environ.get("XDG_STATE_HOME", ""))
    # By the specification, a relative path is invalid and is ignored.
    home = given if given.is_absolute() else Path("~/.local/state").expanduser()
    return home / "lupin-twin"


def finish_replacing(path: Path) -> None:
    """Put a new file in the place of a journal that is gone, if there is one."""
    if path.exists():  # killed before that: the new file would come back when this one is removed
        ready(path).unlink(missing_ok=True)
    elif ready(path).exists():
        # SQLite would take them for those of the new file. Who reads the old one has them open, and
        # nobody opens them meanwhile: there is no journal.
        delete(path, "-wal", "-shm")
        ready(path).rename(path)
        sync(path.parent)


def ready(path: Path) -> Path:
    """A new file that is complete, and waits for the journal's place."""
    return path.with_name(path.name + ".new")


def delete(path: Path, *ends: str) -> None:
    """Delete a file and those of SQLite beside it, or only those with these endings."""
    for end in ends or ("", "-journal", "-wal", "-shm"):
        path.with_name(path.name + end).unlink(missing_ok=True)


class InUse(Exception):
    """Another process writes this journal; the message names it."""


class Lock:
    """A journal's lock for writing, held from construction to `close`.

    Raises:
        InUse: another process holds it.
        OSError: the folder cannot be written.

    """

    def __init__(self, journal: Path, holder: str) -> None:
        self._descriptor = os.open(_beside(journal), os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        try:
            fcntl.flock(self._descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            # Whoever writes next would begin an empty journal.
            finish_replacing(journal)
        except BlockingIOError:
            other = _name_in(self._descriptor)
            os.close(self._descriptor)
            raise InUse(f"the journal {journal} is in use by {other}") from None
        except BaseException:
            os.close(self._descriptor)
            raise
        # The holder's name is only for the message: on a full disk the lock works without it.
        try:
            os.ftruncate(self._descriptor, 0)
            os.pwrite(self._descriptor, f"{holder} (process {os.getpid()})\n".encode(), 0)
        except OSError:
            pass

    def close(self) -> None:
        """Release the lock."""
        os.close(self._descriptor)


def holder_of(journal: Path) -> str | None:
    """Return who writes a journal, None if nobody does; it takes a shared lock for a moment.

    Raises:
        OSError: the lock exists but cannot be read.

    """
    try:
        descriptor = os.open(_beside(journal), os.O_RDONLY | os.O_CLOEXEC)
    except FileNotFoundError:
        return None
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return _name_in(descriptor)
    finally:
        os.close(descriptor)
    return None


@contextmanager
def writing_alone(journal: Path, holder: str) -> Iterator[sqlite3.Connection]:
    """Open an existing journal for writing while its twin is stopped.

    Raises:
        InUse: a twin writes it.
        Empty, Foreign, DamagedFile, sqlite3.Error, OSError: as `open_named`.

    """
    # Opened first, so that no lock is created beside a file that is not a journal.
    with closing(open_named(journal)):
        pass
    try:
        lock = Lock(journal, holder)
    except InUse as error:
        raise InUse(f"{error}: stop the twin first") from error
    with closing(lock), closing(open_writer(journal)) as connection:
        yield connection


def _beside(journal: Path) -> Path:
    return journal.with_name(journal.name + ".lock")


def _name_in(descriptor: int) -> str:
    return os.read(descriptor, 512).decode("utf-8", "replace").strip() or "another process"


def files_of(journal: Path) -> tuple[int, int]:
    """The numbers of a journal's file and of its WAL, which tell them from others in their place.

    A backup that is copied over the file leaves its number, but gets a new WAL.
    """
    return inode_of(journal), inode_of(journal.with_name(journal.name + "-wal"))


def inode_of(path: Path) -> int:
    """Number of a file; 0 if it does not exist."""
    try:
        return path.stat().st_ino
    except FileNotFoundError:
        return 0


def mark_of(journal: Path) -> Path:
    """The archive's mark: a file with the journal's id, and the last `seq` that is archived."""
    return journal.with_name(journal.name + ".forwarded")


def note_forwarded(journal: Path, journal_id: str, seq: int) -> None:
    """Write the archive's mark.

    Raises:
        OSError: it cannot be written.

    """
    mark = mark_of(journal)
    new = mark.with_name(mark.name + ".new")
    new.write_text(f"{journal_id} {seq}\n", encoding="ascii")
    new.replace(mark)


def forwarded_seq(journal: Path, journal_id: str | None) -> int | None:
    """The last `seq` that is archived; 0 if the mark is another journal's, None without a mark."""
    try:
        words = mark_of(journal).read_text(encoding="ascii").split()
    except FileNotFoundError:
        return None
    except (OSError, UnicodeDecodeError):
        return 0
    is_ours = len(words) == 2 and words[0] == journal_id and words[1].isdecimal()
    return int(words[1]) if is_ours else 0


# Half of the second that is promised; the other half is for the disk.
_PERIOD_S: Final = 0.5


class Syncing:
    """Syncs the write-ahead log (WAL) of an open journal, in a thread, until it is closed.

    Raises:
        OSError: the WAL cannot be opened.

    """

    def __init__(self, journal: Path, period_s: float = _PERIOD_S) -> None:
        log = journal.with_name(journal.name + "-wal")
        self._descriptor = os.open(log, os.O_RDWR | os.O_CLOEXEC)
        self._period_s = period_s
        self._is_dirty = threading.Event()
        self._stop = threading.Event()
        self._error: OSError | None = None
        # The directory entry of a new WAL has to be durable too.
        sync(journal.parent)
        self._thread = threading.Thread(target=self._run, name="journal sync", daemon=True)
        self._thread.start()

    def has_written(self) -> None:
        """Note that the WAL has grown.

        Raises:
            OSError: the last sync failed: it is unknown what is on the disk.

        """
        if self._error is not None:
            raise self._error
        self._is_dirty.set()

    def close(self) -> None:
        """Stop the thread; a sync that hangs is left behind."""
        self._stop.set()
        self._is_dirty.set()
        self._thread.join(timeout=1.0)

    def _run(self) -> None:
        try:
            while not self._stop.is_set():
                self._is_dirty.wait()
                self._stop.wait(self._period_s)
                self._is_dirty.clear()
                os.fdatasync(self._descriptor)
        except OSError as error:
            self._error = error
        finally:
            os.close(self._descriptor)
