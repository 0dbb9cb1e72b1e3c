"""A test's ROS domain is its own: no other test has it, and nobody who is no test."""

from __future__ import annotations

import pytest

from tests.support import domains
from tests.support.domains import own_domain
from tests.support.ros import Peer


def test_two_tests_never_share_a_domain() -> None:
    with own_domain() as one, own_domain() as other:
        assert one != other


def test_who_lives_in_a_domain_is_seen() -> None:
    with own_domain() as domain:
        assert not domains._is_lived_in(domain)
        with Peer(domain):
            assert domains._is_lived_in(domain)


def test_a_domain_in_which_somebody_lives_is_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[int] = []

    def is_lived_in(domain: int) -> bool:
        seen.append(domain)
        return len(seen) == 1

    monkeypatch.setattr(domains, "_is_lived_in", is_lived_in)
    with own_domain() as domain:
        assert domain == seen[-1] != seen[0]
    monkeypatch.setattr(domains, "_is_lived_in", lambda _: True)
    with pytest.raises(RuntimeError, match="all ROS domains are in use"), own_domain():
        pass
