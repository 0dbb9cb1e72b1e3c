"""kill -9 of PostgreSQL, forwarders, twins and pages at 50 random moments; the suite makes six."""

import random
import tempfile
import time
from pathlib import Path

from tests.support.archive_killing import RATE, kill_and_compare
from tests.support.postgres import server

MOMENTS = 50


def main() -> bool:
    """Kill; returns whether archive and journals of two sites have the same rows afterwards."""
    seed = random.randrange(10**6)
    print(f"{MOMENTS} moments, seed {seed}, {RATE} scans a second at each of two sites", flush=True)
    begun_s = time.monotonic()
    with tempfile.TemporaryDirectory() as folder, server() as postgresql:
        try:
            rows = kill_and_compare(postgresql, Path(folder), MOMENTS, seed)
        except AssertionError as error:
            print(f"not the same rows: {error}", flush=True)
            return False
    print(
        f"in {time.monotonic() - begun_s:.0f} s: {rows:,} scans, "
        "the same in journals, archive and page"
    )
    return True
