"""Worker threads and job queues for longer work; small jobs never wait for large ones.

A job is due at its arrival plus `PATIENCE` times its estimated cost, and the earliest due runs
first. So an expensive job lets cheap ones pass, but only those that arrive within `PATIENCE` times
its own cost: no job starves. One thread takes only small jobs (`SMALL_S`), so that they need not
wait for a large one to end either.

Work that nobody waits for ends. `Job.cancel` removes it from the queue or, if it runs already,
turns its `should_stop` true, which long computations check between their steps.
"""

from __future__ import annotations

import math
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future
from functools import partial
from typing import Any, Final, Generic, TypeVar

from lupin_twin.core.past import NotRemembered

# Estimated costs are seconds of one core. The cost of a small job is negligible: a few clients that
# send requests at their allowed rate do not keep the threads busy.
SMALL_S: Final = 0.02
PATIENCE: Final = 2.0
# Threads that take any job; two, so that one heavy job does not hold up all other large ones.
LARGE_THREADS: Final = 2
SMALL_THREADS: Final = 1

# How often a thread asks again whether a job is admitted, s.
_CHECK_S: Final = 0.05

# Plain Python code keeps all other threads waiting; after this long, s, it pauses.
TURN_S: Final = 0.002

ResultT = TypeVar("ResultT")
ItemT = TypeVar("ItemT")
ShouldStop = Callable[[], bool]


class Job(Future[ResultT], Generic[ResultT]):
    """The future of `work(should_stop)`, which is estimated to take `cost_s`."""

    def __init__(
        self,
        work: Callable[[ShouldStop], ResultT],
        cost_s: float,
        arrived_s: float,
        on_cancel: Callable[[Job[ResultT]], None],
    ) -> None:
        super().__init__()
        self.cost_s = cost_s
        self.due_s = arrived_s + PATIENCE * cost_s
        self._work = work
        self._on_cancel = on_cancel
        self._is_abandoned = False

    def should_stop(self) -> bool:
        """Whether nobody waits for the result any more; any thread may ask."""
        return self._is_abandoned

    def cancel(self) -> bool:
        """Abandon the job: remove it from the queue or, if it runs, let it end soon."""
        if not self.done():
            self._is_abandoned = True
            self._on_cancel(self)
        return super().cancel()

    def run(self) -> None:
        """Do the work, in a worker's thread."""
        if not self.set_running_or_notify_cancel():
            return
        try:
            result = self._work(self.should_stop)
        except BaseException as error:  # noqa: BLE001  # handed to whoever waits
            self.set_exception(error)
        else:
            self.set_result(result)
        # The inputs must not live as long as the result.
        del self._work


class Workers:
    """A pool of threads, and the jobs that wait for one. Any thread may call it.

    The threads start with the first job. `clock` tells seconds and never jumps. A job begins once
    `admits(cost_s)`, which is asked in the order of the jobs, and again after a while.
    """

    def __init__(
        self,
        name: str,
        clock: Callable[[], float] = time.monotonic,
        large_threads: int = LARGE_THREADS,
        small_threads: int = SMALL_THREADS,
        admits: Callable[[float], bool] = lambda _: True,
    ) -> None:
        self._name = name
        self._clock = clock
        self._admits = admits
        self._only_small = [False] * large_threads + [True] * small_threads
        self._waiting: list[Job[object]] = []
        self._running: set[Job[object]] = set()
        self._changed = threading.Condition()
        self._threads: list[threading.Thread] = []
        self._is_closed = False

    @property
    def waiting(self) -> int:
        """Jobs that no thread has taken yet."""
        return len(self._waiting)

    @property
    def running(self) -> int:
        """Jobs that a thread is running."""
        return len(self._running)

    def submit(self, work: Callable[[ShouldStop], ResultT], cost_s: float = 0.0) -> Future[ResultT]:
        """Queue `work(should_stop)`; `cost_s` is an estimate, in seconds of one core.

        Raises:
            RuntimeError: the workers were closed.

        """
        job: Job[ResultT] = Job(work, cost_s, self._clock(), self._forget)
        with self._changed:
            if self._is_closed:
                raise RuntimeError("the workers were closed")
            if not self._threads:
                self._start()
            self._waiting.append(job)  # type: ignore[arg-type]  # whatever its result
            self._changed.notify_all()
        return job

    def look_again(self) -> None:
        """Begin what `admits` allows by now, without delay."""
        with self._changed:
            self._changed.notify_all()

    def close(self) -> None:
        """Drop waiting jobs, and ask running ones to stop. Does not wait for them."""
        with self._changed:
            self._is_closed = True
            left = [*self._waiting, *self._running]
            self._changed.notify_all()
        for job in left:
            job.cancel()

    def _forget(self, job: Job[ResultT]) -> None:
        with self._changed:
            if job in self._waiting:
                self._waiting.remove(job)  # type: ignore[arg-type]

    def _start(self) -> None:
        for number, only_small in enumerate(self._only_small):
            thread = threading.Thread(
                target=self._run, args=(only_small,), name=f"{self._name}_{number}", daemon=True
            )
            self._threads.append(thread)
            thread.start()

    def _run(self, only_small: bool) -> None:
        while (job := self._take(only_small)) is not None:
            job.run()
            with self._changed:
                self._running.discard(job)
            del job  # or its result would live until the next one

    def _take(self, only_small: bool) -> Job[object] | None:
        with self._changed:
            while not self._is_closed:
                mine = [job for job in self._waiting if job.cost_s <= SMALL_S or not only_small]
                ordered = sorted(mine, key=lambda job: job.due_s)  # stable: as they arrived
                admitted = (job for job in ordered if self._admits(job.cost_s))
                if (job := next(admitted, None)) is not None:
                    self._waiting.remove(job)
                    self._running.add(job)
                    return job
                self._changed.wait(_CHECK_S if mine else None)
            return None


def in_turns(
    items: Iterable[ItemT],
    clock: Callable[[], float] = time.perf_counter,
    rest: Callable[[float], None] = time.sleep,
) -> Iterator[ItemT]:
    """Yield the items; after each `TURN_S` of the caller's work on them, pause for as long.

    The interpreter runs one thread at a time, and switches only after 5 ms. A loop that makes half
    a million objects would leave next to nothing to a node's thread, which waits for the
    interpreter at each message.
    """
    begun_s = clock()
    for item in items:
        yield item
        if clock() - begun_s >= TURN_S:
            rest(TURN_S)
            begun_s = clock()


# Small, and large, jobs of a queue that have no answer yet, at most.
MAX_JOBS: Final = 32
# Time between two small, or two large, jobs while the owner's thread is behind, s.
PACE_S: Final = 1.0


class JobQueue:
    """Jobs of one thread, which owns the queue, gets the answers, and is not blocked by them.

    A job begins only when every answer was delivered, because the largest takes about 200 MB. While
    `is_behind()` (messages wait for the owner's thread), one small and one large job begin a
    second. `wake()` is called in another thread when `deliver` has something to do. `clock` returns
    seconds and never jumps; the other arguments are those of `Workers`. `answered` counts answers,
    `slowest_s` is the longest that one took.
    """

    def __init__(
        self,
        name: str,
        wake: Callable[[], None],
        is_behind: Callable[[], bool] = lambda: False,
        clock: Callable[[], float] = time.monotonic,
        *,
        large_threads: int = LARGE_THREADS,
        small_threads: int = SMALL_THREADS,
    ) -> None:
        self.answered = 0
        self.slowest_s = 0.0
        self._workers = Workers(name, clock, large_threads, small_threads, self._admits)
        self._wake = wake
        self._is_behind = is_behind
        self._clock = clock
        # Of small jobs, and of large ones: those without an answer, and when the last was begun.
        self._open = [0, 0]
        self._begun_s = [-math.inf, -math.inf]
        self._done: deque[Callable[[], None]] = deque()

    @property
    def waiting(self) -> int:
        """Jobs whose answer has not been delivered yet."""
        return sum(self._open)

    def ask(
        self,
        work: Callable[[ShouldStop], Any],
        reply: Callable[[Any], None],
        cost_s: float = 0.0,
    ) -> None:
        """Have `deliver` call `reply` with what `work(should_stop)` returns or raises.

        Raises:
            NotRemembered: too many small, or large, jobs wait.

        """
        is_large, since_s = cost_s > SMALL_S, self._clock()
        if self._open[is_large] >= MAX_JOBS:
            raise NotRemembered(f"{MAX_JOBS} requests wait, which is the limit")
        self._open[is_large] += 1

        def deliver(answer: Any) -> None:
            self._open[is_large] -= 1
            if not isinstance(answer, Exception):
                self.answered += 1
                self.slowest_s = max(self.slowest_s, self._clock() - since_s)
            reply(answer)

        def run(should_stop: ShouldStop) -> None:
            try:
                answer = work(should_stop)
            except Exception as error:  # noqa: BLE001  # handed to whoever waits
                answer = error
            self._done.append(partial(deliver, answer))
            self._wake()

        self._workers.submit(run, cost_s)

    def deliver(self) -> None:
        """Deliver one answer; if there are more, `wake` is called for the next.

        Sending a large one takes a while, so other callbacks of this thread run in between.
        """
        if not self._done:
            return
        try:
            self._done[0]()
        finally:
            self._done.popleft()
            self._workers.look_again()
            if self._done:
                self._wake()

    def close(self) -> None:
        """End the threads; their current work is abandoned."""
        self._workers.close()

    def _admits(self, cost_s: float) -> bool:
        is_large, now_s = cost_s > SMALL_S, self._clock()
        if self._done or (self._is_behind() and now_s - self._begun_s[is_large] < PACE_S):
            return False
        self._begun_s[is_large] = now_s
        return True
