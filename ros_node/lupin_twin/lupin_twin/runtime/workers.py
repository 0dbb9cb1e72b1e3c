"""Worker threads and job queues for longer work; small jobs never wait for large ones.

Small jobs (`SMALL_S`) have threads of their own. A job is due at its arrival plus `PATIENCE` times
its estimated cost, and the earliest due runs first. So an expensive job lets cheap ones pass, but
only those that arrive within `PATIENCE` times its own cost: no job starves.

Work that nobody waits for ends. `Job.cancel` ends it before it begins or, if it runs already, turns
its `should_stop` true, which long computations check between their steps.
"""

from __future__ import annotations

import math
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future
from functools import partial
from itertools import count
from queue import PriorityQueue
from typing import Any, Final, Generic, TypeVar

from lupin_twin.core.past import NotRemembered

# Estimated costs are seconds of one core. The cost of a small job is negligible: a few clients that
# send requests at their allowed rate do not keep the threads busy.
SMALL_S: Final = 0.02
PATIENCE: Final = 2.0
# For each kind of job, so that one heavy job does not hold up all others.
LARGE_THREADS: Final = 2
_SMALL_THREADS: Final = 2

# Plain Python code keeps all other threads waiting; after this long, s, it pauses.
TURN_S: Final = 0.002

ResultT = TypeVar("ResultT")
ItemT = TypeVar("ItemT")
ShouldStop = Callable[[], bool]


class Job(Future[ResultT], Generic[ResultT]):
    """The future of `work(should_stop)`."""

    def __init__(self, work: Callable[[ShouldStop], ResultT]) -> None:
        super().__init__()
        self._work: Callable[[ShouldStop], ResultT] | None = work
        self._is_abandoned = False

    def should_stop(self) -> bool:
        """Whether nobody waits for the result any more; any thread may ask."""
        return self._is_abandoned

    def cancel(self) -> bool:
        """Abandon the job: it never begins or, if it runs, ends soon."""
        self._is_abandoned = True
        if is_cancelled := super().cancel():
            self._work = None
        return is_cancelled

    def run(self) -> None:
        """Do the work, in a worker's thread."""
        # The inputs must not live as long as the result.
        work, self._work = self._work, None
        if work is None or not self.set_running_or_notify_cancel():
            return
        try:
            result = work(self.should_stop)
        except BaseException as error:  # noqa: BLE001  # handed to whoever waits
            self.set_exception(error)
        else:
            self.set_result(result)


class Workers:
    """Threads for large jobs, and others for small ones. Any thread may call it.

    The threads start with the first job. `clock` tells seconds and never jumps. `jobs` wait or run.
    """

    def __init__(
        self,
        name: str,
        clock: Callable[[], float] = time.monotonic,
        large_threads: int = LARGE_THREADS,
    ) -> None:
        self.jobs: set[Job[Any]] = set()
        self._clock = clock
        self._numbers = count()  # of equal jobs, the first to arrive is the first to run
        # Of small jobs, and of large ones; None ends a thread.
        self._queues = tuple(PriorityQueue[tuple[float, int, Job[Any] | None]]() for _ in range(2))
        self._lock = threading.Lock()
        self._is_closed = False
        self._threads = [
            threading.Thread(target=self._run, args=(queue,), name=f"{name}_{number}", daemon=True)
            for queue, threads in zip(self._queues, (_SMALL_THREADS, large_threads), strict=True)
            for number in range(threads)
        ]

    def submit(self, work: Callable[[ShouldStop], ResultT], cost_s: float = 0.0) -> Future[ResultT]:
        """Queue `work(should_stop)`; `cost_s` is an estimate, in seconds of one core.

        Raises:
            RuntimeError: the workers were closed.

        """
        job = Job(work)
        with self._lock:
            if self._is_closed:
                raise RuntimeError("the workers were closed")
            for thread in self._threads:
                if thread.ident is None:
                    thread.start()
            self.jobs.add(job)
        job.add_done_callback(self.jobs.discard)
        due_s = self._clock() + PATIENCE * cost_s
        self._queues[cost_s > SMALL_S].put((due_s, next(self._numbers), job))
        return job

    def close(self) -> None:
        """Drop waiting jobs, and ask running ones to stop. Does not wait for them."""
        with self._lock:
            self._is_closed = True
        for queue in self._queues:
            for _ in self._threads:
                queue.put((-math.inf, next(self._numbers), None))
        for job in tuple(self.jobs):
            job.cancel()

    @staticmethod
    def _run(queue: PriorityQueue[tuple[float, int, Job[Any] | None]]) -> None:
        while (job := queue.get()[-1]) is not None:
            job.run()
            del job  # or its result would live until the next one


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


# How often a job asks again whether it may begin, s.
_CHECK_S: Final = 0.05
# Small, and large, jobs of a queue that have no answer yet, at most.
MAX_JOBS: Final = 32
# Time between two small, or two large, jobs while the owner's thread is behind, s.
PACE_S: Final = 1.0


class JobQueue:
    """Jobs of one thread, which owns the queue, gets the answers, and is not blocked by them.

    A job begins only when every answer was delivered, because the largest takes about 200 MB. While
    `is_behind()` (messages wait for the owner's thread), one small and one large job begin a
    second. `wake()` is called in another thread when `deliver` has something to do. `clock` returns
    seconds and never jumps; `large_threads` is that of `Workers`. `answered` counts answers,
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
    ) -> None:
        self.answered = 0
        self.slowest_s = 0.0
        self._workers = Workers(name, clock, large_threads)
        self._wake = wake
        self._is_behind = is_behind
        self._clock = clock
        # Of small jobs, and of large ones: those without an answer, and when the last was begun.
        self._open = [0, 0]
        self._begun_s = [-math.inf, -math.inf]
        self._changed = threading.Condition()
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
            with self._changed:
                while not self._admits(is_large):
                    if should_stop():
                        return
                    self._changed.wait(_CHECK_S)
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
            with self._changed:
                self._changed.notify_all()
            if self._done:
                self._wake()

    def close(self) -> None:
        """End the threads; their current work is abandoned."""
        self._workers.close()

    def _admits(self, is_large: bool) -> bool:
        now_s = self._clock()
        if self._done or (self._is_behind() and now_s - self._begun_s[is_large] < PACE_S):
            return False
        self._begun_s[is_large] = now_s
        return True
