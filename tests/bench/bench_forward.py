"""Forwarding a week's journal into a PostgreSQL on the same machine: readings a second.

30 tags with five sensors, a scan of each every two minutes. `--quick`: a day.
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from lupin_twin.core.state import Scan
from tests.support.archive import Archive, forward_once
from tests.support.journal import NOW, SECOND, kept, scan, select
from tests.support.postgres import server

TAGS = 30
SENSORS = ("temperature", "humidity", "co2", "light", "moisture")


def main(arguments: Sequence[str] = ()) -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--quick", action="store_true")
    days = 1 if parser.parse_args(arguments).quick else 7
    with server(fsync=True) as postgresql, tempfile.TemporaryDirectory() as folder:
        journal, archive = Path(folder) / "journal.sqlite", Archive(postgresql)
        rows: list[Scan] = []
        for n in range(days * 720 * TAGS):
            readings = {name: 20.0 + (n * k % 997) / 7 for k, name in enumerate(SENSORS, 1)}
            rows.append(scan(str(n % TAGS), NOW + n * 4 * SECOND, source="robot", **readings))
        kept(journal, rows)
        begun_s = time.monotonic()
        forward_once(archive, journal)
        took_s = time.monotonic() - begun_s
        (count,) = select(journal, "SELECT count(*) FROM scan")[0]
        readings_sent = int(str(count)) * len(SENSORS)
        print(f"{days} days: {count} scans, {readings_sent} readings in {took_s:.1f} s")
        print(f"{readings_sent / took_s:,.0f} readings a second, the start of a process included")
        assert len(archive.rows()["scan"]) == count


if __name__ == "__main__":
    main(sys.argv[1:])
