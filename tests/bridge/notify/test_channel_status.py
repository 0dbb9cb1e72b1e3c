"""How long a channel waits."""

from lupin_bridge.notify.messages import Backoff


def test_each_failure_doubles_the_wait_up_to_the_limit_with_a_half_at_random() -> None:
    backoff = Backoff(1.0, 60.0)
    for whole_s in (1, 2, 4, 8, 16, 32, 60, *[60] * 5_000):
        assert whole_s / 2 <= backoff.wait_s() <= whole_s
    backoff.succeeded()
    assert backoff.wait_s() <= 1.0
