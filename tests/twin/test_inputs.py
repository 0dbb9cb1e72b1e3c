from __future__ import annotations

import os
from pathlib import Path

from lupin_twin.inputs import Input, other_users


def test_other_users_are_those_who_own_ports_of_the_domain(tmp_path: Path) -> None:
    own = os.geteuid()
    (tmp_path / "fastrtps_port7650").touch()  # 7400 + 250 * 1
    assert other_users(1, tmp_path, own) == []
    assert other_users(1, tmp_path, own + 1) == [f"uid {own}"]
    assert other_users(2, tmp_path, own + 1) == [], "of another domain"
    assert other_users(1, tmp_path / "none", own + 1) == []


def test_what_two_subscriptions_hear_is_heard_once() -> None:
    heard = Input(depth=50)
    heard.subscriptions = 2
    one = {"source_timestamp": 5, "publication_sequence_number": 1}
    of_another = {"source_timestamp": 6, "publication_sequence_number": 1}
    assert [heard.is_new(info) for info in (one, of_another, one, of_another)] == [
        *(True, True),
        *(False, False),
    ]
