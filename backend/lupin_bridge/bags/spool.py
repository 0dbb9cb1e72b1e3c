"""What was written and has not reached the disk yet: a full disk costs nothing but room."""

from __future__ import annotations

import os


class Spool:
    """A stream whose `write` never fails, and `drain`, which may, and may be called again.

    The library that writes MCAP cannot go on after an error in the middle of a record. Here there
    is none for it: once the disk takes more, the file goes on where it stopped.
    """

    def __init__(self, file: int) -> None:
        self._file = file
        self._waiting = bytearray()
        self._drained = 0

    @property
    def waiting(self) -> int:
        """Bytes that the file does not have yet."""
        return len(self._waiting)

    def write(self, data: bytes) -> int:
        """Take some more."""
        self._waiting += data
        return len(data)

    def tell(self) -> int:
        """How long the file will be."""
        return self._drained + len(self._waiting)

    def flush(self) -> None:
        """Nothing: see `drain`."""

    def drain(self) -> None:
        """Write what waits into the file.

        Raises:
            OSError: not all of it could be written; the rest waits on.

        """
        while self._waiting:
            written = os.write(self._file, self._waiting)
            del self._waiting[:written]
            self._drained += written
