"""One process a journal: a lock beside the file, let go of by the kernel when its holder dies."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path
from typing import Self


class InUse(Exception):
    """Another process writes this journal; the message names it."""


class Lock:
    """Held from construction to `release`.

    Raises:
        InUse: another process holds it.
        OSError: the folder cannot be written.

    """

    def __init__(self, journal: Path, holder: str) -> None:
        self._descriptor = os.open(_beside(journal), os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        try:
            fcntl.flock(self._descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            other = _name_in(self._descriptor)
            os.close(self._descriptor)
            raise InUse(f"the journal {journal} is in use by {other}") from None
        except BaseException:
            os.close(self._descriptor)
            raise
        # Who holds it is only for the message: on a full disk the lock holds all the same.
        try:
            os.ftruncate(self._descriptor, 0)
            os.pwrite(self._descriptor, f"{holder} (process {os.getpid()})\n".encode(), 0)
        except OSError:
            pass

    def release(self) -> None:
        """Let others write."""
        os.close(self._descriptor)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.release()


def holder_of(journal: Path) -> str | None:
    """Who writes a journal, None if nobody does; for a moment it holds the lock with others.

    Raises:
        OSError: the lock is there and may not be read.

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


def _beside(journal: Path) -> Path:
    return journal.with_name(journal.name + ".lock")


def _name_in(descriptor: int) -> str:
    return os.read(descriptor, 512).decode("utf-8", "replace").strip() or "another process"
