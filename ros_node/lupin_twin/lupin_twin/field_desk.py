"""Fields that are computed on workers for who asks over ROS: each once, and only so many at once.

The desk belongs to the thread of the store. Workers get immutable jobs; their results come back
through a queue, and `deliver` takes them on the desk's own thread.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import Future
from queue import Empty, SimpleQueue
from typing import Any, Final

from lupin_twin.fields import FieldEngine, FieldJob, FieldKey, FieldRefused
from lupin_twin.grid import FieldGrid
from lupin_twin.past import passing
from lupin_twin.workers import Workers

# Fields that wait for a worker or are computed, each with all who wait for it.
MAX_FIELDS: Final = 32
# All who wait for one; each is a few hundred bytes.
MAX_WAITING: Final = 1_000

Reply = Callable[[FieldGrid | Exception], None]


class FieldDesk:
    """Takes jobs, and hands each field, or the error it met, to all who asked for it.

    `computed` counts the fields, `slowest_s` is the longest that one took, waiting included.
    `wake()` is called in a worker's thread, when `deliver` has something to do.
    """

    def __init__(self, engine: FieldEngine, workers: Workers, wake: Callable[[], None]) -> None:
        self.computed = 0
        self.slowest_s = 0.0
        self._engine = engine
        self._workers = workers
        self._wake = wake
        self._waiting: dict[FieldKey, list[Reply]] = {}
        self._done: SimpleQueue[tuple[FieldJob, float, Future[FieldGrid]]] = SimpleQueue()

    @property
    def computing(self) -> int:
        """Fields that are computed or wait for it."""
        return len(self._waiting)

    def ask(self, job: FieldJob, reply: Reply) -> None:
        """Have `reply` called with the field, from `deliver`.

        Raises:
            FieldRefused: too much is being computed.

        """
        if sum(map(len, self._waiting.values())) >= MAX_WAITING:
            raise FieldRefused(
                passing(f"{MAX_WAITING} requests wait for fields, which is the limit")
            )
        if job.key in self._waiting:
            self._waiting[job.key].append(reply)
            return
        if len(self._waiting) >= MAX_FIELDS:
            raise FieldRefused(
                passing(f"{MAX_FIELDS} fields are being computed, which is the limit")
            )
        self._waiting[job.key] = [reply]
        future = self._workers.submit(job.compute, job.cost_s)
        asked_s = time.monotonic()
        future.add_done_callback(lambda done: self._put(job, asked_s, done))

    def _put(self, job: FieldJob, asked_s: float, done: Future[Any]) -> None:
        self._done.put((job, asked_s, done))
        self._wake()

    def deliver(self) -> None:
        """Hand out what has been computed, and keep it."""
        while True:
            try:
                job, asked_s, done = self._done.get_nowait()
            except Empty:
                return
            if done.cancelled():  # the workers were closed
                self._waiting.pop(job.key, None)
                continue
            error = done.exception()
            answer: FieldGrid | Exception
            if error is None:
                answer = done.result()
                self._engine.keep(job, answer)
                self.computed += 1
                self.slowest_s = max(self.slowest_s, time.monotonic() - asked_s)
            else:
                answer = error if isinstance(error, Exception) else RuntimeError(repr(error))
            for reply in self._waiting.pop(job.key, ()):
                reply(answer)
