"""Seeing to it that what the system has taken reaches the disk, in a thread that may hang there."""

from __future__ import annotations

import os
import threading


class Syncing:
    """Syncs one descriptor at a time; `error` is the last failure, to be told by who asks."""

    def __init__(self) -> None:
        self.error: OSError | None = None
        self._thread: threading.Thread | None = None

    @property
    def is_busy(self) -> bool:
        """Whether a sync is under way."""
        return self._thread is not None and self._thread.is_alive()

    def sync(self, file: int) -> None:
        """Sync a descriptor, and close it then; only while none is under way."""
        self._thread = threading.Thread(
            target=self._run, args=(file,), name="bag sync", daemon=True
        )
        self._thread.start()

    def _run(self, file: int) -> None:
        try:
            os.fdatasync(file)
        except OSError as error:
            self.error = error
        finally:
            os.close(file)
