"""How a channel does, and how long it waits."""

from __future__ import annotations

from lupin_bridge.notify.retry import MAX_DETAIL, Backoff, Condition


def test_it_is_failing_until_something_is_taken() -> None:
    condition = Condition()
    condition.failing("Connection\nrefused")
    assert (condition.is_connected, condition.detail) == (False, "Connection refused")
    condition.taken(3)
    assert (condition.is_connected, condition.detail) == (True, "")
    assert (condition.sent, condition.failed) == (3, 1)


def test_a_failure_is_told_in_one_short_line() -> None:
    condition = Condition()
    condition.failing("x" * (MAX_DETAIL + 1))
    assert condition.detail == "x" * MAX_DETAIL
    condition.failing("")
    assert condition.detail == "it failed without a reason"


def test_each_failure_waits_twice_as_long_up_to_the_most_a_half_of_it_by_chance() -> None:
    backoff = Backoff(1.0, 60.0)
    for whole_s in (1, 2, 4, 8, 16, 32, 60, *[60] * 5_000):
        assert whole_s / 2 <= backoff.wait_s() <= whole_s
    backoff.succeeded()
    assert backoff.wait_s() <= 1.0
