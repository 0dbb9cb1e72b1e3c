"""What a twin still knows after it was killed, restarted, or started twice."""

import random
from pathlib import Path

from tests.support.journal import is_whole, select
from tests.support.killing import TWICE, kill_and_check

ROUNDS = 3


def test_a_killed_twin_knows_everything_shown_100_ms_before(domain: int, tmp_path: Path) -> None:
    chance, number, journal = random.Random(7), 0, tmp_path / "j.sqlite"
    for _ in range(ROUNDS):
        number = kill_and_check(domain, journal, chance, number)
    assert number > 100
    assert is_whole(journal)
    assert select(journal, TWICE) == []
