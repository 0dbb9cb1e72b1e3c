# ruff: noqa: S608  # SQL is put together of constants
"""The questions to one site's log, in SQL that SQLite and PostgreSQL both understand.

A table that is read in a loop comes first in a CROSS JOIN, because SQLite keeps that order. In
such statements `s` is a series, and `r` a row of `scan` or `look`. A LIMIT of a million keeps a
search apart from the join around it: in the join, PostgreSQL would repeat it for each row.

What writes, checks, repairs or upgrades a log stands where that is done.
"""

from typing import Final

RUNS: Final = (
    "SELECT run, is_simulated, begun_stamp_ns, begun_arrival_ns, begun_seq, joins, ended_stamp_ns"
    " FROM run WHERE site = :site ORDER BY run"
)
META: Final = "SELECT value FROM meta WHERE site = :site AND key = :key"


def of_tag(sql: str, tag: str | None) -> str:
    """The statement for one tag (`:tag`), or for all tags."""
    return sql.replace("{tag}", "" if tag is None else " AND tag = :tag")


# --- rows of a period, in which stamps are at least :start and below :end -------------------------

_PERIOD: Final = "r.stamp_ns >= :start AND r.stamp_ns < :end AND r.is_copy = 0"
# Of all tags of a run, or of one, see `of_tag`.
SCANS: Final = (
    "FROM series AS s CROSS JOIN scan AS r WHERE s.site = :site AND s.run = :run{tag}"
    f" AND r.site = :site AND r.series = s.series AND {_PERIOD}"
)
INSPECTIONS: Final = f"FROM look AS r WHERE r.site = :site AND r.run = :run{{tag}} AND {_PERIOD}"
EVENTS: Final = (
    "FROM event WHERE site = :site AND run = :run AND event = :event{tag}"
    " AND stamp_ns >= :start AND stamp_ns < :end"
)
# The site's events by the hour, of all kinds.
TALLIES: Final = "FROM tally WHERE site = :site AND run = :run AND hour >= :first AND hour < :last"
# The scans of a series; and the hours of one of its sensors.
READINGS: Final = f"FROM scan AS r WHERE r.site = :site AND r.series = :series AND {_PERIOD}"
HOURS: Final = (
    "FROM hour WHERE site = :site AND series = :series AND hour >= :first AND hour < :last"
    " AND sensor = :place"
)
STAMPS: Final = f"SELECT stamp_ns {SCANS} UNION ALL SELECT stamp_ns {INSPECTIONS}"
# A few steps in the index for each series.
_END: Final = (
    "(SELECT {0}(stamp_ns) FROM scan AS r WHERE r.site = s.site AND r.series = s.series"
    f" AND {_PERIOD})"
)
ENDS: Final = (
    f"SELECT {_END.format('min')}, {_END.format('max')} FROM series AS s"
    " WHERE s.site = :site AND s.run = :run{tag}"
    f" UNION ALL SELECT min(stamp_ns), max(stamp_ns) {INSPECTIONS}"
)
SILENCES: Final = (
    "SELECT stamp_ns, stamp_ns + value FROM event WHERE site = :site AND run = :run"
    " AND event = :event AND value > :longest AND stamp_ns < :end AND stamp_ns + value > :start"
    " AND stamp_ns >= :least AND stamp_ns + value <= :most ORDER BY stamp_ns"
)
SILENCE_BEFORE: Final = (
    "SELECT stamp_ns, stamp_ns + value FROM event WHERE site = :site AND run = :run"
    " AND event = :event AND stamp_ns < :at ORDER BY stamp_ns DESC LIMIT 1"
)
_TALLIED: Final = (
    "SELECT first_ns, last_ns FROM tally WHERE site = :site AND run = :run AND event = :event"
    " ORDER BY hour {} LIMIT 1"
)
FIRST_TALLY: Final = _TALLIED.format("ASC")
LAST_TALLY: Final = _TALLIED.format("DESC")
SENSORS: Final = (
    "SELECT DISTINCT sensors FROM series WHERE site = :site AND run = :run AND kind = 0"
)
SERIES: Final = (
    "SELECT series, sensors FROM series WHERE site = :site AND run = :run AND tag = :tag"
    " AND kind = 0 ORDER BY series"
)


def buckets(hours: str) -> str:
    """Buckets of :width hours, of the rows of hourly counts."""
    return (
        "SELECT (hour - :origin) / :width AS bucket, CAST(sum(n) AS BIGINT),"
        " CAST(sum(total) AS DOUBLE PRECISION), CAST(min(low) AS DOUBLE PRECISION),"
        f" CAST(max(high) AS DOUBLE PRECISION) {hours} GROUP BY bucket"
    )


def total(hours: str) -> str:
    """The number of what the hourly counts have; counting ends when at least :most are found."""
    return f"SELECT coalesce(sum(n), 0) FROM (SELECT n {hours} LIMIT :most) AS first"


def count(rows: str) -> str:
    """How many rows there are; counting ends at :most."""
    return f"SELECT count(*) FROM (SELECT stamp_ns {rows} LIMIT :most) AS first"


# --- what an `Observation` is made of -------------------------------------------------------------

_SCAN: Final = (
    "SELECT s.sensors, r.readings, s.tag, r.stamp_ns, r.status, r.detail, r.source,"
    " coalesce(r.own_stamp_ns, r.stamp_ns), r.mission, r.arrival_ns, s.kind, r.seq, s.run"
)
_WHOLE_INSPECTION: Final = (
    "SELECT r.seq, r.run, r.tag, r.stamp_ns, r.source, coalesce(r.own_stamp_ns, r.stamp_ns),"
    " r.mission, r.arrival_ns, r.species, r.confidence, r.anomaly, r.flower_count, r.bug_count,"
    " r.blooms, r.box"
)
# Who follows the log does not draw flowers, and some have thousands of numbers.
_INSPECTION: Final = _WHOLE_INSPECTION.replace("r.blooms, r.box", "'[]', '[]'")
SCANS_OF_PERIOD: Final = f"{_SCAN} {SCANS.format(tag='')}"
INSPECTIONS_OF_PERIOD: Final = f"{_INSPECTION} {INSPECTIONS.format(tag='')}"
_NEXT: Final = "seq > :after AND r.is_copy = 0 ORDER BY seq LIMIT :count"
NEXT_SCANS: Final = (
    f"{_SCAN} FROM scan AS r JOIN series AS s ON s.site = r.site AND s.series = r.series"
    f" WHERE r.site = :site AND {_NEXT}"
)
NEXT_INSPECTIONS: Final = f"{_INSPECTION} FROM look AS r WHERE r.site = :site AND {_NEXT}"
NEXT_ARRIVAL: Final = (
    "SELECT seq, arrival_ns FROM scan WHERE site = :site AND seq > :after ORDER BY seq LIMIT 1"
)


def _recent(table: str, joined: str, which: str) -> str:
    """Of each series in a period, the rows from the stamp on that is the last but :more.

    The rows have one lower bound: of two, SQLite's index may take the one that reads every row.
    """
    of_series = f"r.site = s.site AND {joined}"
    rows = f"{of_series} AND {_PERIOD}"
    return (
        f"FROM (SELECT s.*, coalesce((SELECT DISTINCT stamp_ns FROM {table} AS r WHERE {rows}"
        " ORDER BY stamp_ns DESC LIMIT 1 OFFSET :more), :start) AS first_ns FROM series AS s"
        f" WHERE s.site = :site AND s.run = :run AND {which} LIMIT 1000000) AS s"
        f" CROSS JOIN {table} AS r WHERE {of_series} AND r.stamp_ns >= s.first_ns"
        " AND r.stamp_ns < :end AND r.is_copy = 0"
    )


_OF_SERIES: Final = "r.series = s.series"
RECENT_SCANS: Final = f"{_SCAN} " + _recent("scan", _OF_SERIES, "s.kind = 0 AND s.sensors != '[]'")
RECENT_INSPECTIONS: Final = f"{_INSPECTION} " + _recent(
    "look", "r.run = s.run AND r.tag = s.tag", "s.kind = 1"
)
# Of each tag, the last attempts to scan it.
RECENT_STAMPS: Final = "SELECT DISTINCT s.tag, r.stamp_ns " + _recent(
    "scan", _OF_SERIES, "s.kind = 0{tag}"
)
# Of the series with the same :sensors.
RECENT_READINGS: Final = "SELECT s.tag, r.stamp_ns, r.seq, r.readings " + _recent(
    "scan", _OF_SERIES, "s.kind = 0 AND s.sensors = :sensors"
)

# --- rows as they were handed over ----------------------------------------------------------------

_SCAN_OF_RUN: Final = (
    f"{_SCAN} FROM scan AS r CROSS JOIN series AS s ON s.site = r.site AND s.series = r.series"
    " WHERE r.site = :site AND s.run = :run AND"
)
_INSPECTION_OF_RUN: Final = (
    f"{_WHOLE_INSPECTION} FROM look AS r WHERE r.site = :site AND r.run = :run AND"
)
_LAST: Final = "r.seq >= :since ORDER BY r.seq DESC LIMIT :most"
LAST_SCANS: Final = f"{_SCAN_OF_RUN} {_LAST}"
LAST_INSPECTIONS: Final = f"{_INSPECTION_OF_RUN} {_LAST}"
_LISTED: Final = "r.seq IN (SELECT value FROM json_each({}))"
LISTED_SCANS: Final = f"{_SCAN_OF_RUN} {_LISTED.format(':scans')}"
LISTED_INSPECTIONS: Final = f"{_INSPECTION_OF_RUN} {_LISTED.format(':looks')}"
_NEWEST_FIRST: Final = "ORDER BY r.stamp_ns DESC, r.seq DESC LIMIT :depth"
LATEST_INSPECTIONS: Final = f"{_INSPECTION_OF_RUN} r.tag = :tag {_NEWEST_FIRST}"
# Of one series: it is fast in both databases.
LATEST_SCANS: Final = (
    f"{_SCAN} FROM series AS s CROSS JOIN scan AS r WHERE s.site = :site AND s.series = :series"
    f" AND r.site = s.site AND r.series = s.series {_NEWEST_FIRST}"
)
SERIES_OF_TAG: Final = "SELECT series FROM series WHERE site = :site AND run = :run AND tag = :tag"


def outermost(table: str, way: str) -> str:
    """The first (ASC) or last (DESC) row of a table up to a number."""
    return (
        f"SELECT seq, stamp_ns, arrival_ns FROM {table} WHERE site = :site AND seq <= :upto"
        f" ORDER BY seq {way} LIMIT 1"
    )


# --- the state as of a moment ---------------------------------------------------------------------


def _states(which: str, but: str) -> str:
    """The latest scan of each series that counts at :at."""
    return (
        "SELECT s.series, s.tag, s.sensors, r.seq, r.stamp_ns, r.status, r.detail, r.readings"
        " FROM series AS s CROSS JOIN scan AS r"
        f" WHERE s.site = :site AND s.run = :run {which} AND r.site = s.site AND r.seq ="
        " (SELECT seq FROM scan WHERE site = s.site AND series = s.series AND stamp_ns <= :at"
        f" AND seq >= :since {but}ORDER BY stamp_ns DESC, seq DESC LIMIT 1)"
    )


STATE_SCANS: Final = _states("", "")
# In a series without sensors, the latest row may be a failure, and an earlier one a success.
STATE_BARE_SCANS: Final = _states(
    "AND s.kind = 0 AND s.sensors = '[]'", "AND status = 0 AND readings = '[]' "
)
STATE_INSPECTIONS: Final = (
    "SELECT s.series, s.tag, r.seq, r.stamp_ns, r.species, r.confidence, r.anomaly,"
    " r.flower_count, r.bug_count, r.blooms, r.box"
    " FROM series AS s JOIN look AS r ON r.site = s.site"
    " AND r.seq = (SELECT seq FROM look WHERE site = s.site AND run = s.run AND tag = s.tag"
    " AND stamp_ns <= :at AND seq >= :since ORDER BY stamp_ns DESC, seq DESC LIMIT 1)"
    " WHERE s.site = :site AND s.run = :run AND s.kind = 1"
)
FIRST_FAILURE: Final = (
    "SELECT min(stamp_ns) FROM series AS s JOIN scan AS r ON r.site = s.site"
    " AND r.series = s.series WHERE s.site = :site AND run = :run AND tag = :tag"
    " AND seq >= :since AND stamp_ns <= :at"
)
PLACES: Final = (
    "SELECT seq, tag, stamp_ns, arrival_ns, is_copy, x, y, z, qx, qy, qz, qw FROM place"
    " WHERE site = :site AND run = :run ORDER BY seq"
)

# --- exports --------------------------------------------------------------------------------------

EXPORTED: Final = (
    f"SELECT r.stamp_ns, r.seq, s.tag, s.sensors, r.status, r.source, r.readings {SCANS}"
)
_OF_ALL_RUNS: Final = f"r WHERE r.site = :site AND {_PERIOD}"
NUMBERS: Final = (
    f"SELECT seq FROM scan AS {_OF_ALL_RUNS} UNION ALL SELECT seq FROM look AS {_OF_ALL_RUNS}"
    " ORDER BY seq"
)
FIRST_STAMP: Final = f"SELECT min(stamp_ns) {SCANS}"

# --- notes ----------------------------------------------------------------------------------------

NOTE_COUNT: Final = "SELECT count(*) FROM note WHERE site = :site"
NOTE_IDS: Final = "SELECT id FROM note WHERE site = :site ORDER BY id DESC"
NEWEST_NOTES: Final = (
    "SELECT id, made_at_ns, made_by, kind, subject, text, until_ns FROM note WHERE site = :site"
    " ORDER BY made_at_ns DESC, id DESC LIMIT :most"
)
