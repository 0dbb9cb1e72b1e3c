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
        self._descriptor = os.open(
            journal.with_name(journal.name + ".lock"), os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600
        )
        try:
            fcntl.flock(self._descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            other = os.read(self._descriptor, 512).decode("utf-8", "replace").strip()
            os.close(self._descriptor)
            raise InUse(
                f"the journal {journal} is in use by {other or 'another process'}"
            ) from None
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
