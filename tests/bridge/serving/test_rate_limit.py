"""Rate limits per client: burst, average, bounded table, and which addresses are one client."""

import pytest

from lupin_bridge.serving.admission import RateLimit, client_key


def taken(limit: RateLimit, client: str, now_s: float, attempts: int) -> int:
    return sum(limit.take(client, now_s) == 0.0 for _ in range(attempts))


def test_a_burst_passes_at_once_and_the_next_turn_waits_an_interval() -> None:
    limit = RateLimit(rate_hz=20.0, burst=40.0)
    assert taken(limit, "a", 100.0, 60) == 40
    assert limit.take("a", 100.0) == pytest.approx(0.05)
    assert limit.wait_s("a", 100.04) == pytest.approx(0.01)
    assert taken(limit, "a", 100.05, 2) == 1
    assert taken(limit, "a", 3_600.0, 60) == 40
    assert taken(limit, "a", 3_600.0, 60) == 0, "a long rest saves up one burst and no more"


def test_several_turns_are_taken_together_or_not_at_all() -> None:
    limit = RateLimit(rate_hz=10.0, burst=5.0)
    assert limit.take("a", 0.0, 6) == pytest.approx(0.1)
    assert limit.take("a", 0.0, 5) == 0.0
    assert limit.take("a", 0.0) == pytest.approx(0.1)


def test_the_table_is_bounded_and_drops_the_least_recently_active() -> None:
    limit = RateLimit(rate_hz=0.001, burst=1.0, max_keys=3)
    for client in ("a", "b", "c", "d", "e"):
        assert limit.take(client, 0.0) == 0.0
    assert limit.take("a", 0.0) == 0.0, "it was forgotten"
    assert limit.take("e", 0.0) > 0.0, "it was not"
    limit = RateLimit(rate_hz=0.001, burst=2.0, max_keys=2)
    for client in ("a", "b", "a", "c"):
        limit.take(client, 0.0)
    assert limit.take("a", 0.0) > 0.0, "of b less was heard"


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
def test_an_address_identifies_its_client(address: str, client: str) -> None:
    assert client_key(address) == client
