"""The other end of the process that looks back: what is read once for all who ask at once."""

from __future__ import annotations

import threading
from concurrent.futures import CancelledError, ThreadPoolExecutor

import pytest

from lupin_bridge.twin.past_child import _States
from lupin_twin.state import Snapshot
from tests.support.waiting import PATIENCE_S, wait_for

KEY = (5, 1)


def test_who_asks_of_a_moment_that_is_being_read_waits_for_that() -> None:
    states, gate, read = _States(), threading.Event(), []

    def reading() -> Snapshot:
        read.append(threading.get_ident())
        gate.wait(PATIENCE_S)
        return Snapshot(5, "map", ())

    with ThreadPoolExecutor(4) as threads:
        first = threads.submit(states.get, KEY, reading, lambda: False)
        wait_for(lambda: read, "the first")
        others = [threads.submit(states.get, KEY, reading, lambda: False) for _ in range(2)]
        # Of another moment, and of a state that was told since, it is another answer.
        newer = threads.submit(states.get, (5, 2), reading, lambda: False)
        wait_for(lambda: len(read) == 2, "the newer one")
        gate.set()
        found = {id(each.result(PATIENCE_S)) for each in (first, *others)}
        assert len(found) == 1
        assert id(newer.result(PATIENCE_S)) not in found
    assert len(read) == 2
    assert states._being_read == {}


def test_who_waits_for_one_that_failed_reads_for_himself_and_may_leave() -> None:
    states, gate, is_reading = _States(), threading.Event(), threading.Event()

    def failing() -> Snapshot:
        is_reading.set()
        gate.wait(PATIENCE_S)
        raise CancelledError

    with ThreadPoolExecutor(3) as threads:
        first = threads.submit(states.get, KEY, failing, lambda: False)
        wait_for(is_reading.is_set, "the first")
        own = Snapshot(5, "map", ())
        second = threads.submit(states.get, KEY, lambda: own, lambda: False)
        left = threads.submit(states.get, KEY, lambda: own, lambda: True)
        with pytest.raises(CancelledError):
            left.result(PATIENCE_S)
        gate.set()
        with pytest.raises(CancelledError):
            first.result(PATIENCE_S)
        assert second.result(PATIENCE_S) is own
