"""A recording: one file behind the other, each of which stands alone.

Time is an argument; the thread is the caller's (`bag_writer`).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from lupin_bridge.bags.bag_file import BagFile
from lupin_bridge.bags.topics import Topic

# What is kept of a latched topic for the next file, bytes; its newest message whatever it has.
MAX_REPEATED: Final = 8_000_000
# Between two tries to begin the next file, s.
RETRY_S: Final = 1.0


@dataclass(frozen=True, slots=True)
class Limits:
    """When a file is followed by the next: bytes and s, 0: never."""

    max_bytes: int = 0
    max_s: float = 0.0


class Recording:
    """Messages on their way into files: the first at `path`, those behind it numbered.

    Raises:
        OSError, LookupError: see `BagFile`.

    """

    def __init__(self, path: Path, topics: Sequence[Topic], limits: Limits, now_s: float) -> None:
        self.counts = [0] * len(topics)
        self._path = path
        self._topics = topics
        self._limits = limits
        self._latched: list[deque[tuple[int, bytes]]] = [deque() for _ in topics]
        self._file = BagFile(path, topics)
        self.paths = [path]
        self._begun_s = now_s
        self._try_s = now_s
        self._has_messages = False
        # The file that is being written was removed, or its name is another's.
        self.is_gone = False
        # Finished, and not yet whole on the disk.
        self._behind: list[BagFile] = []

    @property
    def size(self) -> int:
        """Bytes in the file that is being written."""
        return self._file.size

    @property
    def waiting(self) -> int:
        """Bytes that the disk has not taken yet."""
        return self._file.waiting + sum(file.waiting for file in self._behind)

    def write(self, topic: int, log_ns: int, publish_ns: int, data: bytes) -> None:
        """Take a message."""
        self._file.write(topic, log_ns, publish_ns, data)
        self._has_messages = True
        self.counts[topic] += 1
        if count := self._topics[topic].latched:
            kept = self._latched[topic]
            kept.append((publish_ns, data))
            while len(kept) > count or (
                len(kept) > 1 and sum(len(other) for _, other in kept) > MAX_REPEATED
            ):
                kept.popleft()

    def rotate_if_due(self, log_ns: int, now_s: float) -> Path | None:
        """Begin the next file, if this one is large or old enough, or gone; returns its path then.

        What a late subscriber would get comes first in it, logged at `log_ns`.

        Raises:
            OSError: the next one cannot be made; this one is gone on with.

        """
        if not self._is_full(now_s) or now_s < self._try_s:
            return None
        self._try_s = now_s + RETRY_S
        file = self._next_file()
        self._file.finish()
        self._behind.append(self._file)
        self._file = file
        self.paths.append(file.path)
        self._begun_s, self._has_messages, self.is_gone = now_s, False, False
        for topic, kept in enumerate(self._latched):
            for publish_ns, data in kept:
                file.write(topic, log_ns, publish_ns, data)
        return file.path

    def _is_full(self, now_s: float) -> bool:
        limits = self._limits
        is_full = 0 < limits.max_bytes <= self._file.size
        is_old = 0 < limits.max_s <= now_s - self._begun_s
        return self.is_gone or (self._has_messages and (is_full or is_old))

    def _next_file(self) -> BagFile:
        number = len(self.paths)
        while True:
            path = self._path.with_stem(f"{self._path.stem}_{number}")
            try:
                return BagFile(path, self._topics)
            except FileExistsError:
                number += 1  # somebody else's: nothing is overwritten

    def flush(self) -> None:
        """Give the system all there is, so that a kill cannot take it back.

        Raises:
            OSError: it did not take all; nothing is lost, call it again.

        """
        while self._behind:
            self._behind[0].flush_rest()
            self._behind.pop(0).close()
        self._file.flush()
        self.is_gone = self._file.is_gone

    def duplicate(self) -> int:
        """A descriptor of the file that is being written, to be synced and closed by who asks."""
        return self._file.duplicate()

    def finish(self) -> None:
        """Finish the last file too.

        Raises:
            OSError: not all of it is on the disk; what is, is as after a kill.

        """
        self._file.finish()
        self._behind.append(self._file)
        while self._behind:
            file = self._behind.pop(0)
            try:
                file.flush_rest()
            finally:
                file.close()
