# ruff: noqa: S608  # SQL is put together of constants
"""What is in the archive, by site, and whether its rows fit each other."""

from __future__ import annotations

from typing import Any, Final

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
        lines.append(
            f"{site}: {', '.join(counts)}; the last received {last if last_ns else 'never'};"
            f" {live} {machine} (process {process}); {epoch or 0} journals"
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
