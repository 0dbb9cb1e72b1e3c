"""The workers, by their clock; and the queue of jobs before them."""

import gc
import threading
import weakref
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Future
from contextlib import contextmanager
from functools import partial
from typing import Any, TypeVar

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lupin_twin.core.past import NotRemembered, error_of, message_of
from lupin_twin.field.idw import Abandoned
from lupin_twin.runtime.workers import (
    LARGE_THREADS,
    MAX_JOBS,
    PACE_S,
    PATIENCE,
    SMALL_S,
    TURN_S,
    JobQueue,
    ShouldStop,
    Workers,
    in_turns,
)
from tests.support.waiting import PATIENCE_S, wait_for

LARGE_S = 10.0
T = TypeVar("T")


class Clock:
    now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


@contextmanager
def workers(large_threads: int = LARGE_THREADS) -> Iterator[tuple[Workers, Clock]]:
    clock = Clock()
    running = Workers("test", clock, large_threads)
    try:
        yield running, clock
    finally:
        running.close()


def occupy(running: Workers, cost_s: float, jobs: int) -> Callable[[], None]:
    """Keep that many threads busy; returns a function that frees them."""
    is_free = threading.Event()
    begun = [running.submit(lambda _: is_free.wait(PATIENCE_S), cost_s) for _ in range(jobs)]
    wait_for(lambda: all(job.running() for job in begun), "threads that are busy")
    return is_free.set


def threads_of(name: str) -> list[str]:
    return [thread.name for thread in threading.enumerate() if thread.name.startswith(name)]


def result(future: Future[T]) -> T:
    return future.result(PATIENCE_S)


def test_a_small_job_does_not_wait_for_large_ones_running_or_queued() -> None:
    with workers() as (running, _):
        set_free = occupy(running, LARGE_S, LARGE_THREADS)
        queue = [running.submit(lambda _: None, LARGE_S) for _ in range(20)]
        assert result(running.submit(lambda _: "small", SMALL_S)) == "small"
        assert not any(job.running() or job.done() for job in queue)
        set_free()


@settings(max_examples=50)
@given(st.lists(st.tuples(st.floats(0.0, 5.0), st.floats(0.1, 20.0)), min_size=2, max_size=15))
def test_a_job_is_overtaken_by_no_more_than_its_own_cost_allows(
    jobs: list[tuple[float, float]],
) -> None:
    """None starves: jobs later than PATIENCE times its cost are served after it."""
    order: list[int] = []

    def note(number: int, _: ShouldStop) -> None:
        order.append(number)

    arrivals: list[float] = []
    with workers(large_threads=1) as (running, clock):
        set_free = occupy(running, LARGE_S, 1)
        futures = []
        for number, (pause_s, cost_s) in enumerate(jobs):
            clock.now_s += pause_s
            arrivals.append(clock.now_s)
            futures.append(running.submit(partial(note, number), cost_s))
        set_free()
        for future in futures:
            result(future)
    for place, number in enumerate(order):
        passed_by = [later for later in order[:place] if later > number]
        cost_s = jobs[number][1]
        for later in passed_by:
            assert arrivals[later] <= arrivals[number] + PATIENCE * cost_s
    # And the cheaper of two simultaneous ones goes first.
    due = [arrival + PATIENCE * cost for arrival, (_, cost) in zip(arrivals, jobs, strict=True)]
    assert order == sorted(range(len(jobs)), key=lambda number: due[number])


def test_a_job_cancelled_in_the_queue_never_runs() -> None:
    ran = []
    with workers() as (running, _):
        set_free = occupy(running, LARGE_S, LARGE_THREADS)
        job = running.submit(lambda _: ran.append(1), LARGE_S)
        assert job.cancel()
        last = running.submit(lambda _: None, LARGE_S)
        set_free()
        result(last)
    assert ran == []
    with pytest.raises(CancelledError):
        result(job)


def test_a_running_job_that_is_cancelled_has_to_stop() -> None:
    started = threading.Event()

    def work(should_stop: ShouldStop) -> None:
        started.set()
        wait_for(should_stop, "the word to stop")
        raise Abandoned

    with workers() as (running, _):
        job = running.submit(work)
        assert started.wait(PATIENCE_S)
        job.cancel()
        with pytest.raises(Abandoned):
            result(job)
        assert result(running.submit(lambda stop: stop())) is False, "that is another job"


def test_closing_drops_waiting_jobs_stops_running_ones_and_ends_the_threads() -> None:
    running = Workers("to be closed")
    assert threads_of("to be closed") == [], "none before there is work"
    stopped = threading.Event()

    def work(should_stop: ShouldStop) -> None:
        wait_for(should_stop, "the word to stop")
        stopped.set()

    at_work = [running.submit(work, LARGE_S) for _ in range(LARGE_THREADS)]
    wait_for(lambda: all(job.running() for job in at_work), "jobs at work")
    waiting = running.submit(lambda _: None, LARGE_S)
    running.close()
    assert stopped.wait(PATIENCE_S)
    assert waiting.cancelled()
    for job in at_work:
        result(job)
    wait_for(lambda: threads_of("to be closed") == [], "the threads' end")
    with pytest.raises(RuntimeError, match="closed"):
        running.submit(lambda _: None)


def test_closing_ends_a_job_that_may_not_begin_yet() -> None:
    queue = JobQueue("held", lambda: None)
    for _ in range(2):  # the second waits until the first answer is delivered
        queue.ask(lambda _: None, lambda _: None)
    jobs = queue._workers.jobs
    wait_for(lambda: [job.running() for job in tuple(jobs)] == [True], "one that waits")
    queue.close()
    wait_for(
        lambda: not any(thread.name.startswith("held") for thread in threading.enumerate()),
        "the end of its threads",
    )


def test_a_jobs_input_and_result_are_not_retained() -> None:
    class Thing:
        pass

    with workers() as (running, _):
        thing, made = Thing(), Thing()
        seen, result_seen = weakref.ref(thing), weakref.ref(made)

        def work(_: ShouldStop, thing: Thing = thing, made: Thing = made) -> Thing:
            assert thing is not made
            return made

        future = running.submit(work)
        del work, thing, made
        assert result(future) is result_seen()
        wait_for(lambda: gc.collect() is not None and seen() is None, "the end of the input")
        del future
        wait_for(lambda: gc.collect() is not None and result_seen() is None, "the result's end")


def test_a_loop_over_many_items_pauses_after_each_turn() -> None:
    clock, made = Clock(), list[int]()
    rests = list[tuple[int, float]]()
    for item in in_turns(range(10), clock, lambda seconds: rests.append((len(made), seconds))):
        made.append(item)
        clock.now_s += 0.4 * TURN_S
    assert made == list(range(10))
    assert rests == [(3, TURN_S), (6, TURN_S), (9, TURN_S)]


NOT_SMALL_S = 2 * SMALL_S


class Stage:
    """A queue on real workers, whose jobs end when a test says so."""

    def __init__(self) -> None:
        self.woken = threading.Semaphore(0)
        self.is_behind = False
        self.now_s = 100.0
        self.queue = JobQueue(
            "test", self.woken.release, lambda: self.is_behind, lambda: self.now_s, large_threads=1
        )
        self.begun: list[Future[int]] = []
        self.answers: list[Any] = []

    def ask(self, cost_s: float = 0.0) -> Future[int]:
        job: Future[int] = Future()

        def work(_: ShouldStop) -> int:
            self.begun.append(job)
            return job.result(PATIENCE_S)

        self.queue.ask(work, self.answers.append, cost_s)
        return job

    def wake(self) -> None:
        wait_for(lambda: self.woken.acquire(blocking=False), "the owner to be woken")

    def delivered(self) -> Any:
        """The next answer; a wake-up brings one at most, and may find none."""
        before = len(self.answers)
        while len(self.answers) == before:
            self.wake()
            self.queue.deliver()
        assert len(self.answers) == before + 1
        return self.answers[-1]

    def have_begun(self, *jobs: Future[int]) -> None:
        wait_for(lambda: set(self.begun) == set(jobs), f"{len(jobs)} jobs to begin")


@pytest.fixture
def made() -> Iterator[Stage]:
    stage = Stage()
    yield stage
    stage.queue.close()
    for job in stage.begun:
        job.cancel()


def test_a_failing_job_is_answered_and_delays_nobody(made: Stage) -> None:
    error = NotRemembered("no journal")
    for job in [made.ask(NOT_SMALL_S) for _ in range(2)]:
        job.set_exception(error)
        assert made.delivered() is error
    assert made.queue.waiting == 0


def test_an_answer_that_cannot_be_sent_delays_nobody(made: Stage) -> None:
    def reply(answer: int) -> None:
        raise RuntimeError(answer)

    made.queue.ask(lambda _: 1, reply, NOT_SMALL_S)
    made.wake()
    after = made.ask(NOT_SMALL_S)
    with pytest.raises(RuntimeError):
        made.queue.deliver()
    after.set_result(2)
    assert made.delivered() == 2


def test_large_jobs_run_one_at_a_time_and_small_ones_do_not_wait(made: Stage) -> None:
    large = [made.ask(NOT_SMALL_S) for _ in range(2)]
    made.have_begun(large[0])
    small = made.ask(SMALL_S)
    made.have_begun(large[0], small)
    large[0].set_result(0)
    made.wake()
    assert made.begun == [large[0], small], "before the last is handed out"
    made.queue.deliver()
    made.have_begun(*large, small)
    small.set_result(1)
    assert made.delivered() == 1


@pytest.mark.parametrize("cost_s", [SMALL_S, NOT_SMALL_S])
def test_jobs_wait_for_observations_except_one_a_second(made: Stage, cost_s: float) -> None:
    made.is_behind = True
    first = made.ask(cost_s)
    made.have_begun(first)
    second, third = made.ask(cost_s), made.ask(cost_s)
    first.set_result(0)
    assert made.delivered() == 0
    made.now_s += PACE_S - 0.01
    assert made.begun == [first], "one answer is no leave for the next"
    made.now_s += 0.02
    wait_for(lambda: len(made.begun) == 2, "one more")
    assert made.queue.waiting == 2
    made.is_behind = False
    second.set_result(1)
    third.set_result(1)
    assert [made.delivered(), made.delivered()] == [1, 1]


def test_small_jobs_that_wait_for_observations_hold_up_no_large_one(made: Stage) -> None:
    made.is_behind = True
    first, *_ = [made.ask() for _ in range(3)]
    first.set_result(0)
    assert made.delivered() == 0
    large = made.ask(NOT_SMALL_S)
    made.have_begun(first, large)


@pytest.mark.parametrize("cost_s", [SMALL_S, NOT_SMALL_S])
def test_the_number_of_waiting_jobs_is_limited_and_one_more_has_to_retry(
    made: Stage, cost_s: float
) -> None:
    jobs = [made.ask(cost_s) for _ in range(MAX_JOBS)]
    with pytest.raises(NotRemembered, match=rf"{MAX_JOBS} requests .* the limit") as refused:
        made.ask(cost_s)
    assert isinstance(error_of(message_of(refused.value)), NotRemembered)
    jobs[0].set_result(0)
    made.delivered()
    made.ask(cost_s)


def test_a_flood_of_large_jobs_refuses_no_small_one(made: Stage) -> None:
    for _ in range(MAX_JOBS):
        made.ask(NOT_SMALL_S)
    made.ask().set_result(7)
    assert made.delivered() == 7
