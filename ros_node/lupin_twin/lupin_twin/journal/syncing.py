"""Making the write-ahead log last: a thread that syncs it while another writes.

A commit puts the log into the system's memory, where it outlives a killed process. Against a power
cut it has to be on the disk, and that may take the disk a while: the thread that writes must not
wait for it. This one writes nothing: it syncs what the other has written, through a descriptor of
its own (of the log alone: closing one of the database would take SQLite's locks with it).
"""

from __future__ import annotations

import os
import threading
from pathlib import Path
from typing import Final

from lupin_twin.journal.schema import sync_folder

# Half of what is promised; the other half is for the disk.
_PERIOD_S: Final = 0.5


class Syncing:
    """Syncs the log of an open journal until it is closed.

    Raises:
        OSError: the log cannot be opened.

    """

    def __init__(self, journal: Path, period_s: float = _PERIOD_S) -> None:
        log = journal.with_name(journal.name + "-wal")
        self._descriptor = os.open(log, os.O_RDWR | os.O_CLOEXEC)
        self._period_s = period_s
        self._is_dirty = threading.Event()
        self._stop = threading.Event()
        self._error: OSError | None = None
        # The name of a new log has to last too.
        sync_folder(journal.parent)
        self._thread = threading.Thread(target=self._run, name="journal sync", daemon=True)
        self._thread.start()

    def has_written(self) -> None:
        """The log has grown.

        Raises:
            OSError: the last sync failed: nobody knows what of it is on the disk.

        """
        if self._error is not None:
            raise self._error
        self._is_dirty.set()

    def close(self) -> None:
        """End the thread; a sync that hangs is left to itself."""
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
