from __future__ import annotations

from lupin_twin.journal.writer import Entry, Pending
from tests.support.journal import scan


def entry(number: int) -> Entry:
    return Entry(1, scan(at_ns=number), float(number), number)


def test_what_is_put_is_taken_in_order() -> None:
    pending = Pending()
    for number in range(3):
        pending.put(entry(number))
    assert pending.arrived.is_set()
    assert pending.take(2) == [entry(0), entry(1)]
    assert pending.arrived.is_set()
    assert pending.take(2) == [entry(2)]
    assert not pending.arrived.is_set()


def test_at_its_bound_nothing_is_lost_and_past_it_the_oldest() -> None:
    pending = Pending(max_weight=6)  # a scan of one reading weighs 2
    for number in range(3):
        pending.put(entry(number))
    assert pending.counts() == (3, 0, 0.0)
    pending.put(entry(3))
    assert pending.counts() == (3, 1, 1.0)
    assert pending.take(9) == [entry(1), entry(2), entry(3)]


def test_what_is_taken_waits_until_it_is_done_with() -> None:
    pending = Pending()
    for number in range(3):
        pending.put(entry(number))
    taken = pending.take(2)
    assert pending.counts() == (3, 0, 2.0)
    pending.put_back(taken[1:])
    assert pending.counts() == (2, 0, 1.0)


def test_what_is_put_back_is_the_oldest_again_and_lost_first() -> None:
    pending = Pending(max_weight=6)
    for number in range(3):
        pending.put(entry(number))
    taken = pending.take(2)
    pending.put(entry(3))
    pending.put_back(taken)
    assert pending.counts() == (3, 1, 1.0)
    assert pending.take(9) == [entry(1), entry(2), entry(3)]


def test_what_waits_or_was_lost_is_said_to_be_missing_since_it_was_received() -> None:
    pending = Pending(max_weight=6)
    assert (pending.complete_ns, pending.take_lost()) == (None, None)
    for number in range(1, 4):
        pending.put(entry(number))
    taken = pending.take(1)
    assert pending.complete_ns == 1, "it is not written yet"
    pending.put_back([])
    assert pending.complete_ns == 2
    for number in range(4, 7):
        pending.put(entry(number))
    assert taken == [entry(1)]
    assert pending.counts()[:2] == (3, 2)
    pending.take(3)
    pending.put_back([])
    assert pending.complete_ns == 2, "two were lost"
    assert pending.take_lost() == 3
    assert Pending().complete_ns == pending.complete_ns


def test_one_that_weighs_more_than_all_may_is_kept_alone() -> None:
    pending = Pending(max_weight=1)
    pending.put(entry(0))
    assert pending.take(1) == [entry(0)]
    pending.put_back([])
    assert pending.counts() == (0, 0, None)
