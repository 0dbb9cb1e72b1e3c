"""The archive of a fleet: how fast a journal is forwarded, how the archive grows, and its answers.

Rows of a site as it is forwarded: five sensors, a scan of each of 30 tags every two minutes.
Further sites have the same. PostgreSQL writes each commit to the disk of this machine.
"""

import random
import statistics
import time
from dataclasses import replace

import psycopg

from lupin_twin.core.past import SeriesRequest
from lupin_twin.journal.fold import state_at
from lupin_twin.journal.queries import series
from lupin_twin.journal.schema import SiteLog
from tests.bench.journal_double import BEGUN_NS, Greenhouse, filled
from tests.support.archive import Archive, forward_once
from tests.support.journal import SECOND
from tests.support.postgres import server

TAGS = 30
HOUR = 3_600 * SECOND
DAY = Greenhouse(tags=TAGS, days=1.0, every_s=120.0, inspection_days=0.0, failing=0)


def measure(archive: Archive, sites: int, days: int) -> None:
    """Print rows, bytes, and how long queries take."""
    chance, end_ns = random.Random(7), replace(DAY, days=float(days)).end_ns
    with psycopg.connect(archive.owner, autocommit=True) as connection:
        connection.execute("VACUUM ANALYZE")
        ((size,),) = connection.execute(
            "SELECT sum(pg_total_relation_size(oid)) FROM pg_class WHERE relkind = 'r'"
            " AND relnamespace = 'public'::regnamespace"
        ).fetchall()
        states, past = [], []
        for _ in range(40):
            log = SiteLog(connection, f"gh{chance.randrange(sites)}")
            at_ns = BEGUN_NS + HOUR + int(chance.random() * (end_ns - BEGUN_NS - 2 * HOUR))
            start = time.perf_counter()
            found = state_at(log, at_ns, "map")  # type: ignore[arg-type]  # queries are of both
            states.append((time.perf_counter() - start) * 1e3)
            assert len(found.tags) == TAGS, len(found.tags)
            requested = SeriesRequest("7", "co2", BEGUN_NS, end_ns, 500)
            start = time.perf_counter()
            series(log, requested, end_ns)
            past.append((time.perf_counter() - start) * 1e3)
    rows = sites * days * DAY.scans * TAGS
    print(
        f"{sites:>5}{days:>6}{rows:>12,}{float(size) / 1e6:>9.0f}{float(size) / rows:>8.0f}"
        f"{min(states):>13.1f}{statistics.median(states):>9.1f}{min(past):>12.1f}",
        flush=True,
    )


def main() -> None:
    """Print how the archive grows with days and with sites; for a sensor the least time too, ms."""
    print(
        "sites  days       scans       MB  B/scan  state ms: least, median  a sensor, all days",
        flush=True,
    )

    def forward_days(archive: Archive, days: int) -> None:
        journal = filled(replace(DAY, days=float(days)))
        begun_s = time.monotonic()
        forward_once(archive, journal.path)
        rate = journal.readings / (time.monotonic() - begun_s)
        print(f"{rate:,.0f} readings forwarded a second, the start of a process included")

    with server(fsync=True) as postgresql:
        for days in (1, 10, 100):
            archive = Archive(postgresql, "gh0")
            forward_days(archive, days)
            measure(archive, 1, days)
            archive.drop()
        archive, done = Archive(postgresql, "gh0"), 1
        forward_days(archive, 1)
        for sites in (10, 100):
            archive.copy_site(*(f"gh{number}" for number in range(done, sites)))
            measure(archive, sites, 1)
            done = sites
