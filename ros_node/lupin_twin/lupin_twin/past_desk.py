"""Questions about the past on their way: looked up elsewhere, brought back to the node's thread.

The desk belongs to that one. What is found is made into a message on a worker: half a million
objects for the largest state, some 200 MB. So large questions are taken one after the other, each
when the one before has been sent; small ones do not wait behind them. Only the sending is left for
the node's thread. And where that does not keep up with what it hears, questions wait until it does,
but for one a second: what is asked costs the machine nothing then that an observation needs.
"""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field
from queue import Empty, SimpleQueue
from typing import Any, Final

from lupin_twin.past import NotRemembered
from lupin_twin.workers import SMALL_S, Workers

# Questions that wait for their answer, large and small; and those of a sort that are dealt with.
MAX_QUESTIONS: Final = 32
LARGE_AT_ONCE: Final = 1
SMALL_AT_ONCE: Final = 4
# While the node's thread is behind, so much time, s, lies between two of a sort.
PACE_S: Final = 1.0

Reply = Callable[[Any], None]


@dataclass(frozen=True, slots=True)
class Question:
    """What is to be looked up, what is made of what was found, and who waits for it.

    `look_up` begins the search, `make` is called in a worker's thread. `cost_s` estimates what it
    takes, s of one core. `reply` is called with what was made, or with the error that was met.
    """

    look_up: Callable[[], Future[Any]]
    make: Callable[[Any], Any]
    cost_s: float
    reply: Reply
    asked_s: float = field(default_factory=time.monotonic)


class PastDesk:
    """Takes questions, and hands each answer, or the error it met, to who asked.

    `wake()` is called in another thread, when `deliver` has something to do. `is_behind()` tells
    whether observations wait; `clock` tells seconds and never jumps. `answered` counts the answers,
    `slowest_s` is the longest that one took.
    """

    def __init__(
        self,
        workers: Workers,
        wake: Callable[[], None],
        is_behind: Callable[[], bool],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.answered = 0
        self.slowest_s = 0.0
        self._workers = workers
        self._wake = wake
        self._is_behind = is_behind
        self._clock = clock
        self._lanes = (_Lane(SMALL_AT_ONCE), _Lane(LARGE_AT_ONCE))
        self._done: SimpleQueue[tuple[Question, Any]] = SimpleQueue()

    @property
    def waiting(self) -> int:
        """Questions whose answer has not been handed out yet."""
        return sum(len(lane.waiting) + lane.under_way for lane in self._lanes)

    def ask(self, question: Question) -> None:
        """Have the question answered by `deliver`.

        Raises:
            NotRemembered: too much is being asked.

        """
        if self.waiting >= MAX_QUESTIONS:
            raise NotRemembered(
                f"{MAX_QUESTIONS} questions about the past wait, which is the limit",
                is_lasting=False,
            )
        lane = self._lane(question)
        lane.waiting.append(question)
        self._go_on_in(lane)

    def go_on(self) -> None:
        """Begin what may be begun by now; to be called now and then."""
        for lane in self._lanes:
            self._go_on_in(lane)

    def deliver(self) -> None:
        """Hand out one answer; where there are more, `wake` is called for the next.

        Sending a large one takes a while, and what else waits for this thread comes in between.
        """
        try:
            question, answer = self._done.get_nowait()
        except Empty:
            return
        if not self._done.empty():
            self._wake()
        if not isinstance(answer, Exception):
            self.answered += 1
            self.slowest_s = max(self.slowest_s, time.monotonic() - question.asked_s)
        try:
            question.reply(answer)
        finally:
            lane = self._lane(question)
            lane.under_way -= 1
            self._go_on_in(lane)

    def _lane(self, question: Question) -> _Lane:
        return self._lanes[question.cost_s > SMALL_S]

    def _go_on_in(self, lane: _Lane) -> None:
        while lane.waiting and lane.under_way < lane.at_once:
            now_s = self._clock()
            if self._is_behind() and now_s - lane.begun_s < PACE_S:
                return
            lane.begun_s = now_s
            lane.under_way += 1
            self._look_up(lane.waiting.popleft())

    def _look_up(self, question: Question) -> None:
        def put(answer: Any) -> None:
            self._done.put((question, answer))
            self._wake()

        def found(search: Future[Any]) -> None:
            # In whichever thread searched: that one is not for making messages.
            try:
                what = search.result()
                making = self._workers.submit(lambda _: question.make(what), question.cost_s)
            except Exception as error:  # noqa: BLE001  # handed to who asked
                put(error)
            else:
                making.add_done_callback(lambda made: put(_outcome(made)))

        try:
            search = question.look_up()
        except Exception as error:  # noqa: BLE001  # handed to who asked
            put(error)
        else:
            search.add_done_callback(found)


@dataclass(slots=True)
class _Lane:
    """Questions of a sort, how many of them are dealt with at once, and when the last was begun."""

    at_once: int
    under_way: int = 0
    begun_s: float = -math.inf
    waiting: deque[Question] = field(default_factory=deque)


def _outcome(made: Future[Any]) -> Any:
    try:
        return made.result()
    except Exception as error:  # noqa: BLE001  # handed to who asked
        return error
