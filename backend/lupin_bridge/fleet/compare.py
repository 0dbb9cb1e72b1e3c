"""Queries of several sites at once: one sensor compared over time, and a report of each site.

The comparison puts the outlier first. A site's value in a bucket is the mean of all its readings
there, of any tag. Buckets are whole hours, which the log has counted already: reading by reading, a
week of fifty sites would take a minute.

The report has what happened between two moments, also by the hour, and the newest notes. Each
site's own report has the rest.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Final
from urllib.parse import quote

import numpy as np
import orjson
from annotated_types import Interval

from lupin_bridge import query_string
from lupin_bridge.feed.query import LogReader
from lupin_bridge.fleet.overview import MAX_LISTED
from lupin_bridge.judge.quantities import DAILY, DERIVED, Sensors
from lupin_bridge.query_string import Name, OfPeriod, OfReport, Parameters, needed, parameter, read
from lupin_bridge.serving.admission import Answer, content_answer
from lupin_bridge.stream.state_json import moment, note_json, stamp
from lupin_twin.core.notes import WITHDRAW, WITHDRAWN, Note
from lupin_twin.core.past import HOUR_NS, Event, Grid, NotFound, PastRefused, grid, seconds
from lupin_twin.core.state import NANOSECONDS_PER_SECOND

MAX_SITES: Final = 50
MAX_DAYS: Final = 31
MAX_POINTS: Final = 500
# As many as fit a chart of a laptop's width: a week by the hour.
_POINTS: Final = 168
_DAY_NS: Final = 24 * HOUR_NS
# Worst-case cost, s of one core, to read what is compared, and to write it.
COMPARE_S: Final = 2.0
# Over the sites, in each bucket: the middle half of them lies between the outer two.
_QUANTILES: Final = (0.25, 0.5, 0.75)
# Digits: enough for any sensor, and the same in whatever order sums were added.
_DIGITS: Final = 9

_HOURS: Final = """
SELECT site, (hour - :origin) / :width AS bucket, sum(n), sum(total)
FROM hour JOIN (
    SELECT site, series, array_position(
        ARRAY(SELECT json_array_elements_text(CAST(sensors AS json))), :sensor) - 1 AS place
    FROM series WHERE site = ANY(:sites) AND kind = 0
) AS of_sensor USING (site, series)
WHERE sensor = place AND hour >= :origin AND hour < :last GROUP BY site, bucket
"""


@dataclass(frozen=True, slots=True)
class OfSites:
    """The parameters of `/api/alarms`."""

    sites: str | None = parameter("names of sites, separated by commas; default: all")


@dataclass(frozen=True, slots=True, kw_only=True)
class OfCompare(OfPeriod):
    """The parameters of `/api/compare`."""

    sensor_type: Name = needed("name of a sensor, as in a reading")
    sites: str | None = parameter(f"names of sites, separated by commas, at most {MAX_SITES}")
    points: Annotated[int, Interval(ge=1, le=MAX_POINTS)] = parameter(
        "maximum number of buckets, each of whole hours", _POINTS
    )


@dataclass(frozen=True, slots=True)
class Compare:
    """The query of `/api/compare`; `sites` are pairs of a site and its name."""

    sensor_type: str
    sites: tuple[tuple[str, str], ...]
    steps: Grid
    unit: str

    def __call__(self, log: LogReader) -> Answer:
        """A `PastQuery`: the answer, from the count and sum of readings by site and bucket."""
        steps = self.steps
        query = {
            "sensor": self.sensor_type,
            "sites": [site for site, _ in self.sites],
            "origin": steps.start_ns // HOUR_NS,
            "last": steps.end_ns // HOUR_NS,
            "width": steps.bucket_ns // HOUR_NS,
        }
        found = log.connection.execute(_HOURS, query).fetchall()
        return content_answer(orjson.dumps(self._body(_means(self, found))))

    def _body(self, means: Mapping[str, np.ndarray[Any, np.dtype[np.float64]]]) -> dict[str, Any]:
        steps = self.steps
        every = np.stack([means[site] for site, _ in self.sites])
        quantiles = np.full((len(_QUANTILES), every.shape[1]), math.nan)
        known = ~np.isnan(every).all(axis=0)
        quantiles[:, known] = np.nanquantile(every[:, known], _QUANTILES, axis=0)
        low, median, high = quantiles
        entries: list[dict[str, Any]] = []
        for site, name in self.sites:
            own = means[site][~np.isnan(means[site])]
            away = (means[site] - median)[~np.isnan(means[site])]
            entries.append(
                {
                    "site": site,
                    "name": name,
                    "mean": _number(own.mean()) if own.size else None,
                    # Also a site that is too warm by day and too cold by night is an outlier.
                    "deviation": _number(math.sqrt((away**2).mean())) if own.size else None,
                    "means": _numbers(means[site]),
                }
            )
        entries.sort(key=_outlier_first)
        return {
            "sensor_type": self.sensor_type,
            "unit": self.unit,
            "from": stamp(steps.start_ns),
            "to": stamp(steps.end_ns),
            "bucket_s": steps.bucket_ns / NANOSECONDS_PER_SECOND,
            "low": _numbers(low),
            "median": _numbers(median),
            "high": _numbers(high),
            "sites": entries,
        }


def compare(
    parameters: Parameters, known: Mapping[str, str], now_ns: int, sensors: Sensors
) -> Compare:
    """The query of `/api/compare`; `known` has the names of all sites.

    Raises:
        NotFound: see `chosen`.
        PastRefused: see `OfPeriod.span`; too many sites, too long a period, a derived quantity.

    """
    given = read(OfCompare, parameters)
    start_ns, end_ns = given.span(now_ns)
    if given.sensor_type in DERIVED or given.sensor_type in DAILY:
        raise PastRefused(
            f"sensor_type is {given.sensor_type!r}, which is derived: expected a measured one"
        )
    names = chosen(given.sites, known)
    if len(names) > MAX_SITES:
        raise PastRefused(f"sites are {len(names)}, the limit is {MAX_SITES}: name some")
    end_ns = end_ns or now_ns
    start_ns = start_ns if given.from_ is not None else max(0, end_ns - _DAY_NS)
    if end_ns - start_ns > MAX_DAYS * _DAY_NS:
        days = (end_ns - start_ns) / _DAY_NS
        raise PastRefused(f"from and to are {days:.1f} days apart, the limit is {MAX_DAYS}")
    steps = grid(start_ns, max(end_ns, start_ns + 1), given.points, HOUR_NS)
    sites = tuple((site, known[site]) for site in names)
    return Compare(given.sensor_type, sites, steps, sensors.named(given.sensor_type).unit)


def chosen(text: str | None, known: Mapping[str, object]) -> list[str]:
    """The sites of a comma-separated list; None: all.

    Raises:
        NotFound: one is not in the archive.

    """
    if text is None:
        return list(known)
    names = list(dict.fromkeys(text.split(",")))
    for name in names:
        if name not in known:
            why = f"there is no site {name[:64]!r} in the archive, which has {len(known)}"
            raise NotFound(why)
    return names


def _means(
    query: Compare, found: Sequence[tuple[str, int, int, float]]
) -> dict[str, np.ndarray[Any, np.dtype[np.float64]]]:
    steps = query.steps
    count = -(-(steps.end_ns - steps.start_ns) // steps.bucket_ns)
    means = {site: np.full(count, math.nan) for site, _ in query.sites}
    for site, bucket, n, total in found:
        if n:
            means[site][bucket] = total / float(n)
    return means


def _outlier_first(entry: Mapping[str, Any]) -> tuple[float, str]:
    deviation = entry["deviation"]
    return math.inf if deviation is None else -deviation, entry["site"]


def _number(value: float) -> float | None:
    return float(f"{value:.{_DIGITS}g}") if math.isfinite(value) else None


def _numbers(values: Any) -> list[float | None]:
    return [_number(value) for value in values]


# --- what happened at every site ------------------------------------------------------------------

# Under the names of `routes_schema.ReportCounts`.
_COUNTED: Final = {
    Event.SCANS: "scans",
    Event.FAILURES: "failed",
    Event.INSPECTIONS: "inspections",
    "notes": "notes",
}
_COUNTS: Final = """
SELECT site, event, sum(n) FROM tally
WHERE site = ANY(:sites) AND hour >= :first AND hour < :last GROUP BY site, event
UNION ALL SELECT site, 'notes', count(*) FROM note
WHERE site = ANY(:sites) AND kind != :withdraw
    AND made_at_ns >= :start AND made_at_ns < :end GROUP BY site
"""
_NOTES: Final = """
SELECT site, id, made_at_ns, made_by, kind, subject, text, until_ns, gone.by, gone.at_ns
FROM (
    SELECT * FROM note WHERE site = ANY(:sites) AND kind != :withdraw
        AND made_at_ns >= :start AND made_at_ns < :end
    ORDER BY made_at_ns DESC, site, id LIMIT :most
) AS newest LEFT JOIN LATERAL (
    SELECT made_by AS by, made_at_ns AS at_ns FROM note AS other
    WHERE other.site = newest.site AND kind = :withdraw AND subject = :withdrawn || newest.id
    ORDER BY other.made_at_ns, other.id LIMIT 1
) AS gone ON true
ORDER BY made_at_ns DESC, site, id
"""


@dataclass(frozen=True, slots=True)
class OfSitesReport(OfReport):
    """The parameters of `/api/report` of the fleet."""

    sites: str | None = parameter("names of sites, separated by commas; default: all")


@dataclass(frozen=True, slots=True)
class SitesReport:
    """The fleet's `/api/report`; `sites` are (site, name, active alarms, last heartbeat in ns)."""

    sites: tuple[tuple[str, str, int | None, int], ...]
    start_ns: int
    end_ns: int

    def __call__(self, log: LogReader) -> Answer:
        """A `PastQuery`: the answer, from the counts by site and event, and the newest notes."""
        connection = log.connection
        query = {
            "sites": [site for site, *_ in self.sites],
            "first": self.start_ns // HOUR_NS,
            "last": self.end_ns // HOUR_NS,
            "start": self.start_ns,
            "end": self.end_ns,
            "withdraw": WITHDRAW,
            "withdrawn": WITHDRAWN,
            "most": MAX_LISTED,
        }
        counted = connection.execute(_COUNTS, query).fetchall()
        counts = Counter({(site, event): int(n) for site, event, n in counted})
        period_query = f"from={seconds(self.start_ns)}&to={seconds(self.end_ns)}"
        rows = [
            {
                "site": site,
                "name": name,
                **{key: counts[site, event] for event, key in _COUNTED.items()},
                "active_alarms": active,
                # A site that has never been forwarded has nothing that is complete.
                "complete_to": moment(min(heartbeat_ns, self.end_ns) or None),
                "report": f"sites/{quote(site, safe='')}/api/report?{period_query}",
            }
            for site, name, active, heartbeat_ns in self.sites
        ]
        names = {site: name for site, name, *_ in self.sites}
        notes = [
            {
                "site": site,
                "name": names[site],
                # Who withdrew it, if anybody did, and when.
                **note_json(
                    Note(*note), {note[0]: Note("", at_ns, by, WITHDRAW, "")} if by else {}
                ),
            }
            for site, *note, by, at_ns in connection.execute(_NOTES, query).fetchall()
        ]
        body = {
            "from": stamp(self.start_ns),
            "to": stamp(self.end_ns),
            "sites": rows,
            "notes": notes,
        }
        return content_answer(orjson.dumps(body))


def sites_report(parameters: Parameters, known: Mapping[str, Any], now_ns: int) -> SitesReport:
    """The query of `/api/report`; `known` has all sites.

    Raises:
        NotFound: see `chosen`.
        PastRefused: see `query_string.report`.

    """
    given = read(OfSitesReport, parameters)
    start_ns, end_ns = query_string.report(given, now_ns)
    sites = [known[name] for name in chosen(given.sites, known)]
    return SitesReport(
        tuple((it.site, it.name or it.site, it.active_alarms, it.heartbeat_ns) for it in sites),
        start_ns // HOUR_NS * HOUR_NS,
        -(-end_ns // HOUR_NS) * HOUR_NS,
    )
