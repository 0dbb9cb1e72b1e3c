"""The thread that writes a recording, and the bounded queue before it.

Who hears the messages never waits for the disk. Twice a second what was heard is handed to the
system, whole: that is what a kill can cost. That it reaches the disk is seen to by one more thread,
for on some disks that takes longer.
"""

from __future__ import annotations

import shlex
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from lupin_bridge.bags.rotation import Recording
from lupin_bridge.bags.syncing import Syncing

FLUSH_S: Final = 0.5
TELL_S: Final = 10.0
# A complaint is repeated so often, s.
COMPLAIN_S: Final = 5.0
# What may wait for this thread, bytes; and what may wait for the disk before this thread waits.
MAX_QUEUED: Final = 64_000_000
MAX_WAITING: Final = 64_000_000
# What a message costs beside its bytes.
_OVERHEAD: Final = 200


@dataclass(frozen=True, slots=True)
class Heard:
    """A message as it came: the index of its topic, and when it came and was published, ns."""

    topic: int
    log_ns: int
    publish_ns: int
    data: bytes


class BagWriter:
    """Writes a recording in a thread of its own; `say(line)` is called there, and must not raise.

    `lost` counts what there was no room for; `is_whole`: all else is in the files, which are
    finished once it has ended. `on_failure()` is called where the thread ends by itself: nothing is
    recorded any more.
    """

    def __init__(
        self,
        recording: Recording,
        names: Sequence[str],
        say: Callable[[str], None],
        on_failure: Callable[[], None] = lambda: None,
        *,
        max_queued: int = MAX_QUEUED,
        max_waiting: int = MAX_WAITING,
    ) -> None:
        self.lost = 0
        self.is_whole = True
        self._recording = recording
        self._names = names
        self._say = say
        self._on_failure = on_failure
        self._max_queued = max_queued
        self._max_waiting = max_waiting
        self._lock = threading.Lock()
        self._queue: list[Heard] = []
        self._queued = 0
        self._ended = threading.Event()
        # Of those that are lost, what there is never room for; topic and bytes of the last one.
        self._too_large = 0
        self._last_large: tuple[int, int] = (0, 0)
        self._told_too_fast = self._told_too_large = 0
        self._told_counts: list[int] = []
        self._told_s = time.monotonic()
        self._complained_s: dict[str, float] = {}
        self._sick = ""
        self._gone: Path | None = None
        self._syncing = Syncing()
        self._thread = threading.Thread(target=self._run, name="bag", daemon=True)

    # --- for others --------------------------------------------------------------------------

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def put(self, heard: Heard) -> None:
        """Take a message, at once; one that there is no room for is lost, counted and told."""
        cost = len(heard.data) + _OVERHEAD
        with self._lock:
            if self._queued + cost > self._max_queued:
                self.lost += 1
                if cost > self._max_queued:
                    self._too_large += 1
                    self._last_large = heard.topic, len(heard.data)
                return
            self._queue.append(heard)
            self._queued += cost

    def lose(self, count: int) -> None:
        """Count messages that came too fast to be heard."""
        with self._lock:
            self.lost += count

    def end(self) -> None:
        """Write what has been taken, finish the file and end."""
        self._ended.set()
        self._thread.join()

    # --- in the thread -----------------------------------------------------------------------

    def _run(self) -> None:
        try:
            is_last = False
            while not is_last:
                is_last = self._ended.wait(FLUSH_S)
                self._take()
                self._flush()
                self._tell()
            self._finish()
        except Exception as error:  # noqa: BLE001  # no thread dies unseen
            self.is_whole = False
            try:
                self._say(f"recording has failed: {error!r}")
            finally:
                self._on_failure()

    def _finish(self) -> None:
        try:
            self._recording.finish()
        except OSError as error:
            self.is_whole = False
            path = self._recording.paths[-1]
            self._say(
                f"{path} is not finished: {error.strerror}; what is in it comes out by "
                f"lupin-twin mcap recover {shlex.quote(str(path))}"
            )

    def _take(self) -> None:
        if self._recording.waiting > self._max_waiting:
            return
        with self._lock:
            heard, self._queue, self._queued = self._queue, [], 0
        for message in heard:
            try:
                path = self._recording.rotate_if_due(message.log_ns, time.monotonic())
            except OSError as error:
                self._complain("next", f"no next file can be begun: {error.strerror}")
            else:
                if path is not None:
                    self._say(f"recording goes on in {path}")
            self._recording.write(message.topic, message.log_ns, message.publish_ns, message.data)

    def _flush(self) -> None:
        try:
            self._recording.flush()
        except OSError as error:
            self._sick = error.strerror or str(error)
            self._complain(
                "disk",
                f"cannot write {self._recording.paths[-1]}: {self._sick}; "
                f"{mb(self._recording.waiting)} wait in memory",
            )
            return
        if self._sick:
            self._say("the disk takes what is written again: nothing waits any more")
            self._sick = ""
        path = self._recording.paths[-1]
        if self._recording.is_gone and path != self._gone:
            self._gone, self.is_whole = path, False
            self._say(
                f"{path} is another file now: what was recorded into it is lost, unless that has "
                "another name"
                if path.exists()
                else f"{path} was removed, and what was in it is lost"
            )
        if (failed := self._syncing.error) is not None:
            self._syncing.error, self.is_whole = None, False
            self._complain("sync", f"the disk has not kept what it took: {failed.strerror}")
        if not self._syncing.is_busy:
            self._syncing.sync(self._recording.duplicate())

    def _tell(self) -> None:
        now_s = time.monotonic()
        with self._lock:
            too_large, too_fast = self._too_large, self.lost - self._too_large
            topic, size = self._last_large
        if too_fast > self._told_too_fast:
            self._told_too_fast = too_fast
            self._complain("lost", f"{too_fast:,} messages lost so far: they come too fast")
        if too_large > self._told_too_large:
            self._told_too_large = too_large
            self._complain(
                "large",
                f"{too_large:,} messages left out so far, too large for a recording, the last one "
                f"of {self._names[topic]}: {mb(size)}, {mb(self._max_queued)} is the limit",
            )
        counts = self._recording.counts
        if now_s - self._told_s >= TELL_S and counts != self._told_counts:
            self._told_s, self._told_counts = now_s, list(counts)
            self._say(self.summary())

    def _complain(self, what: str, text: str) -> None:
        now_s = time.monotonic()
        if now_s >= self._complained_s.get(what, now_s):
            self._complained_s[what] = now_s + COMPLAIN_S
            self._say(text)

    def summary(self) -> str:
        """What has been heard so far, in one line."""
        counts = self._recording.counts
        topics = ", ".join(
            f"{name} {count:,}" for name, count in zip(self._names, counts, strict=True)
        )
        lost = f"; {self.lost:,} lost" if self.lost else ""
        return f"{sum(counts):,} messages ({topics}){lost}"


def mb(count: int) -> str:
    """Bytes for people."""
    return f"{count / 1e6:,.1f} MB"
