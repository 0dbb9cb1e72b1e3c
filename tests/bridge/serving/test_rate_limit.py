"""Turns per client: the burst, the long run, the bounded table, and who counts as one client."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lupin_bridge.serving.admission import RateLimit, client_key


def taken(limit: RateLimit, client: str, now_s: float, tries: int) -> int:
    return sum(limit.take(client, now_s) == 0.0 for _ in range(tries))


def test_a_burst_is_taken_at_once_and_the_next_turn_waits_an_interval() -> None:
    limit = RateLimit(rate_hz=20.0, burst=40.0)
    assert taken(limit, "a", 100.0, 60) == 40
    assert limit.take("a", 100.0) == pytest.approx(0.05)
    assert limit.wait_s("a", 100.04) == pytest.approx(0.01)
    assert taken(limit, "a", 100.05, 2) == 1


def test_many_turns_are_taken_together_or_not_at_all() -> None:
    limit = RateLimit(rate_hz=10.0, burst=5.0)
    assert limit.take("a", 0.0, 6) == pytest.approx(0.1)
    assert limit.take("a", 0.0, 5) == 0.0
    assert limit.take("a", 0.0) == pytest.approx(0.1)


def test_the_table_is_bounded_and_the_least_recently_active_leaves_first() -> None:
    limit = RateLimit(rate_hz=0.001, burst=1.0, max_keys=3)
    for client in ("a", "b", "c", "d", "e"):
        assert limit.take(client, 0.0) == 0.0
    assert len(limit) == 3
    assert limit.take("a", 0.0) == 0.0, "it was forgotten"
    assert limit.take("e", 0.0) > 0.0, "it was not"


@given(
    rate_hz=st.floats(0.1, 1000.0),
    burst=st.integers(1, 50),
    gaps_s=st.lists(st.floats(0.0, 2.0), min_size=1, max_size=200),
)
def test_no_span_of_time_has_more_turns_than_the_burst_and_its_share(
    rate_hz: float, burst: int, gaps_s: list[float]
) -> None:
    limit = RateLimit(rate_hz, burst)
    now_s, times = 50.0, []
    for gap in gaps_s:
        now_s += gap
        if limit.take("a", now_s) == 0.0:
            times.append(now_s)
    for first, start in enumerate(times):
        for last in range(first, len(times)):
            assert last - first + 1 <= burst + (times[last] - start) * rate_hz + 1e-6


@pytest.mark.parametrize(
    ("address", "client"),
    [
        ("192.168.7.20", "192.168.7.20"),
        ("::ffff:192.168.7.20", "192.168.7.20"),
        ("2001:db8:1:2:3:4:5:6", "2001:db8:1:2::/64"),
        ("2001:db8:1:2::1", "2001:db8:1:2::/64"),
        ("fe80::1%eth0", "fe80::/64"),
        ("::1", "::/64"),
        ("", ""),
        ("a unix socket", "a unix socket"),
    ],
)
def test_an_address_stands_for_its_client(address: str, client: str) -> None:
    assert client_key(address) == client
