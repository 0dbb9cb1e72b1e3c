"""What happened between two moments at every site, counted in whole hours: a row a site.

Hours are what the log has counted already; each site's own report has the rest.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final
from urllib.parse import quote

import orjson

from lupin_bridge.fleet.compare import chosen
from lupin_bridge.past import query as past_query
from lupin_bridge.past.query import OfReport, Parameters
from lupin_bridge.query_string import parameter, read
from lupin_bridge.serving.admission import Answer, json_answer
from lupin_bridge.stream.state_json import stamp
from lupin_twin.core.notes import WITHDRAW
from lupin_twin.core.past import HOUR_NS, Event, PastRefused, seconds

# Under the names of `schema.ReportCounts`.
_COUNTED: Final = {
    Event.SCANS: "scans",
    Event.FAILURES: "failed",
    Event.INSPECTIONS: "inspections",
    "notes": "notes",
}
_COUNTS: Final = """
SELECT site, event, sum(n) FROM tally
WHERE site = ANY(%(sites)s) AND hour >= %(first)s AND hour < %(last)s GROUP BY site, event
UNION ALL SELECT site, 'notes', count(*) FROM note
WHERE site = ANY(%(sites)s) AND kind != %(withdraw)s
    AND made_at_ns >= %(start)s AND made_at_ns < %(end)s GROUP BY site
"""


@dataclass(frozen=True, slots=True)
class OfSitesReport(OfReport):
    """The parameters of `/api/report` of the fleet."""

    sites: str | None = parameter("names with commas between them; default: all")


@dataclass(frozen=True, slots=True)
class SitesReport:
    """`sites` are a site, its name, its active alarms, and up to when it was heard, ns."""

    sites: tuple[tuple[str, str, int | None, int], ...]
    start_ns: int
    end_ns: int

    def read(self, connection: Any) -> Sequence[tuple[str, str, int]]:
        """What was counted, by site and event."""
        query = {
            "sites": [site for site, *_ in self.sites],
            "first": self.start_ns // HOUR_NS,
            "last": self.end_ns // HOUR_NS,
            "start": self.start_ns,
            "end": self.end_ns,
            "withdraw": WITHDRAW,
        }
        found: Sequence[tuple[str, str, int]] = connection.execute(_COUNTS, query).fetchall()
        return found

    def answer(self, found: Sequence[tuple[str, str, int]]) -> Answer:
        """The answer of what was read."""
        counts = Counter({(site, event): int(n) for site, event, n in found})
        asked = f"from={seconds(self.start_ns)}&to={seconds(self.end_ns)}"
        rows = [
            {
                "site": site,
                "name": name,
                **{key: counts[site, event] for event, key in _COUNTED.items()},
                "active_alarms": active,
                "complete_to": stamp(min(heard_ns, self.end_ns)),
                "report": f"sites/{quote(site, safe='')}/api/report?{asked}",
            }
            for site, name, active, heard_ns in self.sites
        ]
        body = {"from": stamp(self.start_ns), "to": stamp(self.end_ns), "sites": rows}
        return json_answer(orjson.dumps(body))


def sites_report(parameters: Parameters, known: Mapping[str, Any], now_ns: int) -> SitesReport:
    """The query of `/api/report`; `known` has all sites.

    Raises:
        NotRemembered: see `compare.chosen`.
        PastRefused: see `past.query.report`.

    """
    given = read(OfSitesReport, parameters, PastRefused)
    start_ns, end_ns = past_query.report(given, now_ns)
    sites = [known[name] for name in chosen(given.sites, known)]
    return SitesReport(
        tuple((it.site, it.name or it.site, it.active_alarms, it.heard_ns) for it in sites),
        start_ns // HOUR_NS * HOUR_NS,
        -(-end_ns // HOUR_NS) * HOUR_NS,
    )
