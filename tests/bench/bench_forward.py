"""Forwarding a week's journal into a PostgreSQL on the same machine: readings a second.

30 tags with five sensors, a scan of each every two minutes.
"""

import time

import psycopg

from tests.bench.journal_double import Greenhouse, filled
from tests.support.archive import Archive, forward_once
from tests.support.postgres import server

WEEK = Greenhouse(tags=30, days=7.0, every_s=120.0, inspection_days=0.0, failing=0)


def main() -> None:
    journal, scans = filled(WEEK), WEEK.scans * WEEK.tags
    with server(fsync=True) as postgresql:
        archive = Archive(postgresql)
        begun_s = time.monotonic()
        forward_once(archive, journal.path)
        took_s = time.monotonic() - begun_s
        assert len(archive.rows()["scan"]) == scans
        with psycopg.connect(archive.owner) as connection:
            ((size,),) = connection.execute(
                "SELECT sum(pg_total_relation_size(oid)) FROM pg_class WHERE relkind = 'r'"
                " AND relnamespace = 'public'::regnamespace"
            )
    print(f"{WEEK.days:g} days: {journal.readings:,} readings in {took_s:.1f} s")
    print(f"{journal.readings / took_s:,.0f} a second, the start of a process included")
    print(f"{float(size) / scans:.0f} bytes a scan")
