from __future__ import annotations

from lupin_twin.journal.writer import Entry, Pending
from tests.support.journal import scan


def entry(number: int) -> Entry:
    return Entry(1, scan(at_ns=number), float(number), number)


def pending(max_weight: int, *numbers: int) -> Pending:
    made = Pending(max_weight)
    for number in numbers:
        made.put(entry(number))
    return made


def test_what_is_taken_is_the_oldest_and_waits_until_it_is_done_with() -> None:
    queue = pending(100, 0, 1, 2)
    taken = queue.take(2)
    assert taken == [entry(0), entry(1)]
    assert queue.arrived.is_set()
    assert queue.counts() == (3, 0, 2.0)
    queue.put_back(taken[1:])
    assert queue.counts() == (2, 0, 1.0)
    assert queue.take(9) == [entry(1), entry(2)]
    assert not queue.arrived.is_set()


def test_past_its_bound_the_oldest_are_lost_what_was_put_back_first() -> None:
    queue = pending(6, 0, 1, 2)  # a scan of one reading weighs 2
    assert queue.counts() == (3, 0, 0.0)
    taken = queue.take(2)
    queue.put(entry(3))
    queue.put_back(taken)
    assert queue.counts() == (3, 1, 1.0)
    assert queue.take(9) == [entry(1), entry(2), entry(3)]
    # One that weighs more than all may is kept alone.
    assert pending(1, 0).take(1) == [entry(0)]


def test_what_waits_or_was_lost_is_said_to_be_missing_since_it_was_received() -> None:
    queue = pending(6, 1, 2, 3)
    queue.take(1)
    assert queue.complete_ns == 1, "it is not written yet"
    queue.put_back([])
    assert (queue.complete_ns, queue.take_lost()) == (2, None)
    for number in range(4, 7):
        queue.put(entry(number))
    queue.take(3)
    queue.put_back([])
    assert queue.complete_ns == 2, "two were lost"
    assert queue.take_lost() == 3
    assert queue.complete_ns is None
