"""kill -9 at 50 random moments under 200 observations a second; the suite makes four of them."""

import random
import tempfile
import time
from pathlib import Path

from tests.support.domains import own_domain
from tests.support.journal import is_whole, select
from tests.support.killing import RATE, SAFE_S, TWICE, kill_and_check

ROUNDS = 50


def main() -> bool:
    """Kill; returns whether everything was there each time, once, in a sound file."""
    seed = random.randrange(10**6)
    chance, number, lost = random.Random(seed), 0, 0
    print(f"{ROUNDS} rounds, seed {seed}, {RATE} observations a second", flush=True)
    begun = time.monotonic()
    with tempfile.TemporaryDirectory() as folder, own_domain() as domain:
        journal = Path(folder) / "j.sqlite"
        for round_ in range(1, ROUNDS + 1):
            try:
                number = kill_and_check(domain, journal, chance, number)
            except AssertionError as error:
                lost += 1
                number += 10_000
                print(f"round {round_}: {error}", flush=True)
            if not is_whole(journal):
                print(f"round {round_}: the file is damaged", flush=True)
                lost += 1
            if round_ % 10 == 0:
                print(f"{round_} rounds", flush=True)
        twice = len(select(journal, TWICE))
        ((rows, runs),) = select(
            journal, "SELECT count(*), count(DISTINCT run) FROM scan JOIN series USING (series)"
        )
    print(
        f"in {time.monotonic() - begun:.0f} s: {rows} observations in the journal, {runs} run(s) of"
        f" the clock; rounds in which anything shown {SAFE_S * 1000:.0f} ms before the kill was"
        f" lost, or the file not whole: {lost}; written twice: {twice}"
    )
    return not lost and not twice
