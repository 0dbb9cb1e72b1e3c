# ruff: noqa: S608  # SQL is put together of constants, and of names of tables
"""What is in the archive, by site, whether its rows fit each other, and what is given up by age.

Scans and inspections are given up. What was counted of them stays.
"""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from typing import Any, Final

from lupin_bridge.archive.database import META_AGAIN, ArchiveError

_SITES: Final = (
    "SELECT site.site, machine, process, heard_at > now() - INTERVAL '10 s',"
    " heard_at::timestamptz(0)::text, (SELECT max(epoch) FROM epoch WHERE epoch.site = site.site)"
    " FROM site LEFT JOIN forwarder ON forwarder.site = site.site ORDER BY site.site"
)
_COUNT: Final = "SELECT count(*), max(arrival_ns) FROM {} WHERE site = %s"
# What fits nothing: rows of a table, of which there should be none.
_STRAY: Final = {
    "scans without a series": (
        "scan WHERE NOT EXISTS (SELECT FROM series WHERE series.site = scan.site"
        " AND series.series = scan.series)"
    ),
    "scans with more or fewer readings than their series has sensors": (
        "scan JOIN series USING (site, series) WHERE json_array_length(readings::json)"
        " <> json_array_length(sensors::json)"
    ),
    "hours without a series": (
        "hour WHERE NOT EXISTS (SELECT FROM series WHERE series.site = hour.site"
        " AND series.series = hour.series)"
    ),
    **{
        f"rows of {table} without a run": (
            f"{table} AS here WHERE NOT EXISTS (SELECT FROM run WHERE run.site = here.site"
            " AND run.run = here.run)"
        )
        for table in ("series", "look", "place", "tally", "event")
    },
    "rows of scan past what was forwarded": (
        "scan WHERE seq > (SELECT max(seq_offset + forwarded_seq) FROM epoch"
        " WHERE epoch.site = scan.site)"
    ),
}


def overview(connection: Any) -> list[str]:
    """A line a site."""
    lines = []
    for site, machine, process, is_live, heard_at, epoch in connection.execute(_SITES).fetchall():
        counts = []
        last_ns = 0
        for table in ("scan", "look", "place"):
            count, newest_ns = connection.execute(_COUNT.format(table), (site,)).fetchone()
            counts.append(f"{count:,} {table}s")
            last_ns = max(last_ns, newest_ns or 0)
        (last,) = connection.execute(
            "SELECT to_timestamp(%s)::timestamptz(0)::text", (last_ns // 10**9,)
        ).fetchone()
        live = "forwarded by" if is_live else f"silent since {heard_at}, forwarded last by"
        whose = "never forwarded" if machine is None else f"{live} {machine} (process {process})"
        lines.append(
            f"{site}: {', '.join(counts)}; the last received {last if last_ns else 'never'};"
            f" {whose}; {epoch or 0} journals"
        )
    return lines or ["no site is forwarded yet"]


def check(connection: Any) -> list[str]:
    """A line for each thing that is wrong."""
    wrong = []
    for what, rows in _STRAY.items():
        (count,) = connection.execute(f"SELECT count(*) FROM {rows}").fetchone()
        if count:
            wrong.append(f"{count:,} {what}")
    return wrong


_NAMED: Final = (
    "SELECT site FROM site WHERE %(site)s::text IS NULL OR site = %(site)s ORDER BY site"
)
# What a simulation said is as old as its arrival.
_RUNS: Final = (
    "SELECT run, CASE is_simulated WHEN 0 THEN 0 ELSE begun_arrival_ns - begun_stamp_ns END"
    " FROM run WHERE site = %s AND joins IS NULL ORDER BY run"
)
# Parts of the tables that are over, each with both of its names.
_MONTHS: Final = (
    "SELECT relname, replace(relname, 'scan', 'look') FROM pg_class WHERE oid IN"
    " (SELECT inhrelid FROM pg_inherits WHERE inhparent = 'scan'::regclass)"
    " AND relname ~ '^scan_[0-9]{4}_[0-9]{2}$'"
    " AND to_date(right(relname, 7), 'YYYY_MM') + INTERVAL '1 month' <= %s ORDER BY relname"
)
_OTHERS: Final = (
    "SELECT EXISTS (SELECT FROM {0} WHERE site <> %(site)s)"
    " OR EXISTS (SELECT FROM {1} WHERE site <> %(site)s)"
)
_UPTO: Final = (
    "INSERT INTO meta SELECT site, 'purged_ns:' || run, max(stamp_ns)::text FROM"
    " (SELECT site, run, stamp_ns FROM {0} JOIN series USING (site, series)"
    " UNION ALL SELECT site, run, stamp_ns FROM {1}) AS gone GROUP BY site, run "
) + META_AGAIN
_DELETE: Final = (
    "WITH scans AS (DELETE FROM scan USING series WHERE scan.site = %(site)s"
    " AND series.site = %(site)s AND scan.series = series.series AND run = %(run)s"
    " AND stamp_ns < %(before)s RETURNING stamp_ns),"
    " looks AS (DELETE FROM look WHERE site = %(site)s AND run = %(run)s"
    " AND stamp_ns < %(before)s RETURNING stamp_ns)"
    " SELECT count(*), max(stamp_ns) FROM (TABLE scans UNION ALL TABLE looks) AS gone"
)


def retain(connection: Any, days: float, site: str | None) -> Iterator[str]:
    """Delete what is older than so many days, of a site or of all; a line for each that had any.

    A month that is over goes as a whole where nothing else is in it, at once.

    Raises:
        ArchiveError: there is no such site.
        psycopg.Error: whatever the database says.

    """
    before = datetime.now(UTC) - timedelta(days=days)
    sites = [name for (name,) in connection.execute(_NAMED, {"site": site}).fetchall()]
    if site is not None and not sites:
        raise ArchiveError(f"the archive has no site {site!r}")
    for names in connection.execute(_MONTHS, (before,)).fetchall():
        with connection.transaction():
            others = {"site": site}
            if site and connection.execute(_OTHERS.format(*names), others).fetchone()[0]:
                continue
            connection.execute(_UPTO.format(*names))
            connection.execute("DROP TABLE {}, {}".format(*names))
        yield f"{names[0][-7:].replace('_', '-')}: the whole month"
    for name in sites:
        count = sum(_of_runs(connection, name, int(before.timestamp() * 10**9)))
        if count:
            yield f"{name}: {count:,} scans and inspections"


def _of_runs(connection: Any, site: str, before_ns: int) -> Iterator[int]:
    for run, lead_ns in connection.execute(_RUNS, (site,)).fetchall():
        gone = {"site": site, "run": run, "before": before_ns - lead_ns}
        with connection.transaction():
            count, upto_ns = connection.execute(_DELETE, gone).fetchone()
            if count:
                row = (site, f"purged_ns:{run}", str(upto_ns))
                connection.execute(f"INSERT INTO meta VALUES (%s, %s, %s) {META_AGAIN}", row)
        yield count
