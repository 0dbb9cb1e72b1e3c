import threading
from collections.abc import Iterator
from concurrent.futures import Future
from typing import Any

import pytest

from lupin_twin.core.past import NotRemembered, error_of, message_of
from lupin_twin.runtime.workers import (
    LARGE_AT_ONCE,
    MAX_QUERIES,
    PACE_S,
    SMALL_AT_ONCE,
    SMALL_S,
    JobQueue,
    Query,
    Workers,
)
from tests.support.waiting import wait_for

LARGE_S = 2 * SMALL_S


class Stage:
    """A queue, and searches that end when a test says so."""

    def __init__(self) -> None:
        self.workers = Workers("test")
        self.woken = threading.Semaphore(0)
        self.is_behind = False
        self.now_s = 100.0
        self.queue = JobQueue(
            self.workers, self.woken.release, lambda: self.is_behind, lambda: self.now_s
        )
        self.begun: list[Future[int]] = []
        self.answers: list[Any] = []

    def query(self, cost_s: float = 0.0) -> Future[int]:
        search: Future[int] = Future()

        def look_up() -> Future[int]:
            self.begun.append(search)
            return search

        self.queue.ask(Query(look_up, self.answers.append, str, cost_s))
        return search

    def delivered(self) -> Any:
        """The next answer; a wake-up brings one at most, and may find none."""
        before = len(self.answers)
        while len(self.answers) == before:
            wait_for(lambda: self.woken.acquire(blocking=False), "the owner to be woken")
            self.queue.deliver()
        assert len(self.answers) == before + 1
        return self.answers[-1]


@pytest.fixture
def made() -> Iterator[Stage]:
    stage = Stage()
    yield stage
    stage.workers.close()


def test_a_failing_query_is_answered_and_delays_nobody(made: Stage) -> None:
    error = NotRemembered("no journal")

    def look_up() -> Future[int]:
        raise error

    for _ in range(2):
        made.queue.ask(Query(look_up, made.answers.append, str, LARGE_S))
    assert made.delivered() is error
    assert made.delivered() is error
    assert made.queue.waiting == 0


def test_an_answer_that_cannot_be_sent_delays_nobody(made: Stage) -> None:
    def reply(answer: str) -> None:
        raise RuntimeError(answer)

    done: Future[int] = Future()
    done.set_result(1)
    made.queue.ask(Query(lambda: done, reply, str, LARGE_S))
    after = made.query(cost_s=LARGE_S)
    wait_for(lambda: made.woken.acquire(blocking=False), "the owner to be woken")
    with pytest.raises(RuntimeError):
        made.queue.deliver()
    after.set_result(2)
    assert made.delivered() == "2"


def test_large_queries_run_one_at_a_time_and_small_ones_do_not_wait(made: Stage) -> None:
    large = [made.query(cost_s=LARGE_S) for _ in range(LARGE_AT_ONCE + 2)]
    small = [made.query(cost_s=SMALL_S) for _ in range(SMALL_AT_ONCE + 1)]
    assert made.begun == [*large[:LARGE_AT_ONCE], *small[:SMALL_AT_ONCE]]
    large[0].set_result(0)
    wait_for(lambda: made.woken.acquire(blocking=False), "the answer")
    assert len(made.begun) == LARGE_AT_ONCE + SMALL_AT_ONCE, "before the last is handed out"
    made.queue.deliver()
    assert made.begun[-1] is large[LARGE_AT_ONCE]
    small[0].set_result(1)
    assert made.delivered() == "1"
    assert made.begun[-1] is small[-1]


@pytest.mark.parametrize("cost_s", [SMALL_S, LARGE_S])
def test_queries_wait_for_observations_except_one_a_second(made: Stage, cost_s: float) -> None:
    made.is_behind = True
    requested = [made.query(cost_s=cost_s) for _ in range(4)]
    assert made.begun == requested[:1]
    requested[0].set_result(0)
    assert made.delivered() == "0"
    made.now_s += PACE_S - 0.01
    made.queue.go_on()
    assert made.begun == requested[:1], "one answer is no leave for the next"
    made.now_s += 0.02
    made.queue.go_on()
    assert made.begun == requested[:2]
    assert made.queue.waiting == 3
    made.is_behind = False
    requested[1].set_result(1)
    assert made.delivered() == "1"
    assert made.begun[:3] == requested[:3], "at once"


@pytest.mark.parametrize("cost_s", [SMALL_S, LARGE_S])
def test_the_number_of_waiting_queries_is_limited_and_one_more_has_to_retry(
    made: Stage, cost_s: float
) -> None:
    searches = [made.query(cost_s=cost_s) for _ in range(MAX_QUERIES)]
    with pytest.raises(NotRemembered, match=rf"{MAX_QUERIES} requests .* the limit") as refused:
        made.query(cost_s=cost_s)
    assert isinstance(error_of(message_of(refused.value)), NotRemembered)
    searches[0].set_result(0)
    made.delivered()
    made.query(cost_s=cost_s)


def test_a_flood_of_large_queries_refuses_no_small_one(made: Stage) -> None:
    for _ in range(MAX_QUERIES):
        made.query(cost_s=LARGE_S)
    made.query().set_result(7)
    assert made.delivered() == "7"
