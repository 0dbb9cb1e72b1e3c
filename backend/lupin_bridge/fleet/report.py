"""What happened between two moments at every site, counted in whole hours, and its newest notes.

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
from lupin_bridge.fleet.overview import MAX_LISTED
from lupin_bridge.past import query as past_query
from lupin_bridge.past.query import OfReport, Parameters
from lupin_bridge.query_string import parameter, read
from lupin_bridge.serving.admission import Answer, json_answer
from lupin_bridge.stream.health_json import note_json
from lupin_bridge.stream.state_json import stamp
from lupin_twin.core.notes import WITHDRAW, WITHDRAWN, Note
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
_NOTES: Final = """
SELECT site, id, made_at_ns, made_by, kind, subject, text, until_ns, gone.by, gone.at_ns
FROM (
    SELECT * FROM note WHERE site = ANY(%(sites)s) AND kind != %(withdraw)s
        AND made_at_ns >= %(start)s AND made_at_ns < %(end)s
    ORDER BY made_at_ns DESC, site, id LIMIT %(most)s
) AS newest LEFT JOIN LATERAL (
    SELECT made_by AS by, made_at_ns AS at_ns FROM note AS other
    WHERE other.site = newest.site AND kind = %(withdraw)s AND subject = %(withdrawn)s || newest.id
    ORDER BY other.id LIMIT 1
) AS gone ON true
ORDER BY made_at_ns DESC, site, id
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

    def read(self, connection: Any) -> tuple[Sequence[Any], Sequence[Any]]:
        """What was counted, by site and event, and the newest notes."""
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
        return tuple(connection.execute(text, query).fetchall() for text in (_COUNTS, _NOTES))

    def answer(self, found: tuple[Sequence[Any], Sequence[Any]]) -> Answer:
        """The answer of what was read."""
        counts = Counter({(site, event): int(n) for site, event, n in found[0]})
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
        names = {site: name for site, name, *_ in self.sites}
        notes = [
            {"site": site, "name": names[site], **_note_json(Note(*note), by, at_ns)}
            for site, *note, by, at_ns in found[1]
        ]
        body = {
            "from": stamp(self.start_ns),
            "to": stamp(self.end_ns),
            "sites": rows,
            "notes": notes,
        }
        return json_answer(orjson.dumps(body))


def _note_json(note: Note, gone_by: str | None, gone_ns: int) -> dict[str, Any]:
    """`people_schema.Note`; who took it back, if anybody did, and when."""
    gone = {} if gone_by is None else {note.id: Note("", gone_ns, gone_by, WITHDRAW, "")}
    return note_json(note, gone)


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
