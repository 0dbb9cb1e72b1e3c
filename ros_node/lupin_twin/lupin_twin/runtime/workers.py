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
from dataclasses import dataclass, field
from functools import partial
from queue import Empty, SimpleQueue
from typing import Any, Final, Generic, TypeVar

from lupin_twin.core.past import NotRemembered

# Estimated costs are seconds of one core. The cost of a small job is negligible: a few clients that
# send requests at their allowed rate do not keep the threads busy.
SMALL_S: Final = 0.02
PATIENCE: Final = 2.0
# Threads that take any job; two, so that one heavy job does not hold up all other large ones.
LARGE_THREADS: Final = 2
SMALL_THREADS: Final = 1

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

    The threads start with the first job. `clock` tells seconds and never jumps.
    """

    def __init__(
        self,
        name: str,
        clock: Callable[[], float] = time.monotonic,
        large_threads: int = LARGE_THREADS,
        small_threads: int = SMALL_THREADS,
    ) -> None:
        self._name = name
        self._clock = clock
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
                if mine:
                    job = min(mine, key=lambda job: job.due_s)  # if equal, the first that arrived
                    self._waiting.remove(job)
                    self._running.add(job)
                    return job
                self._changed.wait()
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


# Limits of small, and of large, queries: those without an answer, and those processed at once.
MAX_QUERIES: Final = 32
LARGE_AT_ONCE: Final = 1
SMALL_AT_ONCE: Final = 4
# Time between two small, or two large, queries while the owner's thread is behind, s.
PACE_S: Final = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Query:
    """What to do on a worker, and who gets the answer.

    `work(should_stop)` makes the answer; `cost_s` is its estimated cost, s of one core. `reply`
    gets the answer, or the exception. `since_s` is when it was made, steady clock.
    """

    work: Callable[[ShouldStop], Any]
    reply: Callable[[Any], None]
    cost_s: float = 0.0
    since_s: float = field(default_factory=time.monotonic)


class JobQueue:
    """Queries of one thread, which owns the queue, gets the answers, and is not blocked by them.

    At most `large_at_once` large queries are processed until their answers are delivered, because
    the largest takes about 200 MB. Small ones do not wait behind them, nor are refused because of
    them. While `is_behind()` (messages wait for the owner's thread), queries wait too, except for
    one a second. `wake()` is called in another thread when `deliver` has something to do. `clock`
    returns seconds and never jumps. `answered` counts answers, `slowest_s` is the longest that one
    took.
    """

    def __init__(
        self,
        workers: Workers,
        wake: Callable[[], None],
        is_behind: Callable[[], bool] = lambda: False,
        clock: Callable[[], float] = time.monotonic,
        large_at_once: int = LARGE_AT_ONCE,
    ) -> None:
        self.answered = 0
        self.slowest_s = 0.0
        self._workers = workers
        self._wake = wake
        self._is_behind = is_behind
        self._clock = clock
        self._lanes = (_Lane(SMALL_AT_ONCE), _Lane(large_at_once))
        self._done: SimpleQueue[tuple[Query, Any]] = SimpleQueue()

    @property
    def waiting(self) -> int:
        """Queries whose answer has not been delivered yet."""
        return sum(lane.count for lane in self._lanes)

    def ask(self, query: Query) -> None:
        """Queue a query, to be answered by `deliver`.

        Raises:
            NotRemembered: too many small, or large, queries wait.

        """
        lane = self._lane(query)
        if lane.count >= MAX_QUERIES:
            raise NotRemembered(f"{MAX_QUERIES} requests wait, which is the limit")
        lane.waiting.append(query)
        self._begin(lane)

    def go_on(self) -> None:
        """Begin the queries that may begin by now; to be called now and then."""
        for lane in self._lanes:
            self._begin(lane)

    def deliver(self) -> None:
        """Deliver one answer; if there are more, `wake` is called for the next.

        Sending a large one takes a while, so other callbacks of this thread run in between.
        """
        try:
            query, answer = self._done.get_nowait()
        except Empty:
            return
        if not self._done.empty():
            self._wake()
        if not isinstance(answer, Exception):
            self.answered += 1
            self.slowest_s = max(self.slowest_s, time.monotonic() - query.since_s)
        try:
            query.reply(answer)
        finally:
            lane = self._lane(query)
            lane.under_way -= 1
            self._begin(lane)

    def _lane(self, query: Query) -> _Lane:
        return self._lanes[query.cost_s > SMALL_S]

    def _begin(self, lane: _Lane) -> None:
        while lane.waiting and lane.under_way < lane.at_once:
            now_s = self._clock()
            if self._is_behind() and now_s - lane.begun_s < PACE_S:
                return
            query = lane.waiting.popleft()
            lane.begun_s = now_s
            lane.under_way += 1
            job = self._workers.submit(query.work, query.cost_s)
            job.add_done_callback(partial(self._put, query))

    def _put(self, query: Query, job: Future[Any]) -> None:
        try:
            answer = job.result()
        except Exception as error:  # noqa: BLE001  # handed to whoever waits
            answer = error
        self._done.put((query, answer))
        self._wake()


@dataclass(slots=True)
class _Lane:
    """Small or large queries, how many are processed at once, and when the last was begun."""

    at_once: int
    under_way: int = 0
    begun_s: float = -math.inf
    waiting: deque[Query] = field(default_factory=deque)

    @property
    def count(self) -> int:
        """Queries whose answer has not been delivered yet."""
        return len(self.waiting) + self.under_way
