"""What the overview shows of each site, as JSON and frames; and a small map of each. Pure.

The map shows where the tags are and how each one is, as an SVG of a few hundred bytes. The colours
are those of the page's `--pin-*`, in light and in dark.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from hashlib import blake2b
from itertools import islice
from typing import Any, Final

import orjson

from lupin_bridge.judge.episodes import Alarm
from lupin_bridge.judge.verdict import ORDER, Health, Kind, Verdict, derive, worst
from lupin_bridge.stream.frames import text_frame
from lupin_bridge.stream.state_json import cause_of, moment, reason_json, stamp
from lupin_twin.core.diagnostics import Origin
from lupin_twin.core.state import Reading, TagState
from lupin_twin.field.grid import reach_of

# Positions along the longer and the shorter side. Of several tags at one position, the worst is
# drawn, so that no map is larger than 7 kB, whatever the site.
_LONG: Final = 40
_SHORT: Final = 20
# Not by colour alone: the worse, the larger. On a large card, dots need less of the map.
_STYLE: Final = (
    "path{stroke-linecap:round;stroke-width:1.8}"
    ".critical{stroke:#c4211a;stroke-width:3}.stressed{stroke:#f5a800;stroke-width:2.4}"
    ".healthy{stroke:#1f7a45}.unknown{stroke:#7d8982}"
    "@media(min-width:150px),(min-height:150px){path{stroke-width:1}.critical{stroke-width:1.8}"
    ".stressed{stroke-width:1.4}}"
    "@media(prefers-color-scheme:dark){.critical{stroke:#ff6456}.stressed{stroke:#ffd166}"
    ".healthy{stroke:#52c7b0}}"
)


def dots(tags: Iterable[TagState], healths: Mapping[str, Health]) -> str:
    """An SVG with a path for each verdict, the worst on top; empty: no tag has a pose.

    It is upright if the greenhouse is longer along y. A tag that is far off the others is left out,
    or the others would become one dot.
    """
    every = [
        (pose.x, pose.y, healths[tag.tag_id].verdict)
        for tag in tags
        if (pose := tag.pose) is not None and tag.tag_id in healths
    ]
    reach = reach_of((x, y) for x, y, _ in every)
    placed = [one for one in every if reach.holds(*one[:2])]
    if not placed:
        return ""
    left, top = min(x for x, _, _ in placed), max(y for _, y, _ in placed)
    width, height = max(x for x, _, _ in placed) - left, top - min(y for _, y, _ in placed)
    across, along = (_LONG, _SHORT) if width >= height else (_SHORT, _LONG)
    metres = max(width / across, height / along) or 1.0
    drawn: dict[tuple[int, int], Verdict] = {}
    for x, y, verdict in placed:
        # y grows upwards in the map frame, and downwards here.
        at = round((x - left) / metres), round((top - y) / metres)
        drawn[at] = worst((drawn.get(at, verdict), verdict)) or verdict
    paths = []
    for verdict in reversed(Verdict):
        path = "".join(f"M{x} {y}h0" for (x, y), its in sorted(drawn.items()) if its is verdict)
        if path:
            paths.append(f'<path class="{verdict}" d="{path}"/>')
    across, along = round(width / metres) + 4, round(height / metres) + 4
    size = f'width="{20 * across}" height="{20 * along}" viewBox="-2 -2 {across} {along}"'
    head = f'<svg xmlns="http://www.w3.org/2000/svg" {size}><style>{_STYLE}</style>'
    return f"{head}{''.join(paths)}</svg>"


def map_version(svg: str) -> str | None:
    """A digest that changes with the map; None: there is nothing to draw."""
    return blake2b(svg.encode(), digest_size=6).hexdigest() if svg else None


# --- what is wrong --------------------------------------------------------------------------------

# Causes on the card of a site.
MAX_CAUSES: Final = 3


def causes(alarms: Iterable[Mapping[str, Any]]) -> tuple[dict[str, Any], ...]:
    """The worst causes of alarms that come worst first: each with its worst alarm and its tags.

    `air` is set if several sensors tell of damp or dry air. Left out are alarms whose value is back
    in range, and the site's silence: its card shows that.
    """
    found: dict[str, list[Mapping[str, Any]]] = {}
    for alarm in alarms:
        if alarm["reason"]["kind"] != Kind.SILENT and verdict_now(alarm) is not Verdict.HEALTHY:
            found.setdefault(cause_of(alarm), []).append(alarm)
    return tuple(
        {
            "reason": {**own[0]["reason"], "verdict": verdict_now(own[0])},
            "tag_id": own[0]["tag_id"],
            "count": len({alarm["tag_id"] for alarm in own}),
            "air": cause if len({alarm["reason"]["sensor"] for alarm in own}) > 1 else None,
        }
        for cause, own in islice(found.items(), MAX_CAUSES)
    )


def verdict_now(alarm: Mapping[str, Any]) -> Verdict:
    """The verdict of an alarm's value now, or if that is not known, its worst so far."""
    return Verdict((alarm["now"] or alarm["reason"])["verdict"])


def now_json(
    alarm: Alarm, tags: Mapping[str, TagState], healths: Mapping[str, Health]
) -> dict[str, Any] | None:
    """An alarm's value at a moment, with its verdict, its reason if out of range, and its time.

    None: it has no value, or its last reading says nothing about that moment.
    """
    kind, sensor = alarm.reason.kind, alarm.reason.sensor
    tag, health = tags.get(alarm.tag_id), healths.get(alarm.tag_id)
    if tag is None or health is None or kind not in {Kind.RANGE, Kind.PEST, Kind.CHANGED}:
        return None
    is_old = any(it.kind is Kind.OLD and it.sensor in {"", sensor} for it in health.reasons)
    if is_old and kind is not Kind.PEST:
        return None
    said = next((it for it in health.reasons if (it.kind, it.sensor) == (kind, sensor)), None)
    reading = next(
        (it for it in (*tag.readings, *derive(tag.readings)) if it.name == sensor), Reading("", 0.0)
    )
    value = said.value if said else reading.value if reading.name else None
    if kind is not Kind.PEST and (value is None or not math.isfinite(value)):
        return None
    return {
        "value": value,
        "verdict": Verdict.HEALTHY if said is None else said.verdict,
        "reason": None if said is None else reason_json(said),
        "observed_at": moment(reading.observed_at_ns),
    }


# --- the overview ---------------------------------------------------------------------------------

# A forwarder sends a heartbeat every two seconds; this long after the last it counts as gone.
LIVE_S: Final = 10.0


@dataclass(frozen=True, slots=True)
class Site:
    """A site as its log and its forwarder show it. Times are ns of the archive's clock.

    `origin` is where its observations come from, as far as its log reports that. `last_seq` grows
    with every row; `heartbeat_ns` is the forwarder's last heartbeat; 0: never. `last_received_ns`
    is when the twin received its newest row, by the clock of its machine. `verdict` and
    `active_alarms`, without shelved ones, are None until they are computed; `causes` is from
    `causes`; `alarms` are the worst active ones, as in `/api/alarms`. `dots` is its map;
    `notes` is the number of notes.
    """

    site: str
    name: str = ""
    last_seq: int = 0
    heartbeat_ns: int = 0
    is_live: bool = False
    last_received_ns: int | None = None
    verdict: Verdict | None = None
    active_alarms: int | None = None
    origin: Origin = "unknown"
    causes: tuple[dict[str, Any], ...] = ()
    alarms: tuple[dict[str, Any], ...] = ()
    dots: str = ""
    notes: int = 0


@dataclass(frozen=True, slots=True)
class Archive:
    """Whether the archive answers; if not, `message` says why, and `since_ns` since when."""

    is_reachable: bool
    message: str = ""
    since_ns: int = 0


def site_json(site: Site, archive: Archive, now_ns: int) -> dict[str, Any]:
    """An entry of `/api/sites`; the verdict of a silent site is unknown."""
    is_live = site.is_live and archive.is_reachable
    return {
        "site": site.site,
        "name": site.name or site.site,
        "verdict": (site.verdict or Verdict.UNKNOWN) if is_live else Verdict.UNKNOWN,
        "last_verdict": site.verdict,
        "active_alarms": site.active_alarms,
        "last_received": moment(site.last_received_ns),
        "lag_s": None
        if not site.heartbeat_ns
        else round(max(0, now_ns - site.heartbeat_ns) / 1e9, 1),
        "is_live": is_live,
        "origin": site.origin,
        "map": map_version(site.dots),
        "causes": site.causes,
    }


def _lasting(site: Site) -> tuple[object, ...]:
    return (
        *(site.site, site.name, site.last_seq, site.is_live),
        *(site.verdict, site.active_alarms, site.last_received_ns, site.origin, site.dots),
        site.causes,
    )


# Entries of an answer at most, the worst first.
MAX_LISTED: Final = 200


def alarms_json(sites: Iterable[Site], archive: Archive) -> dict[str, Any]:
    """`/api/alarms`: active ones, worst first, then newest; of silent sites, the last known.

    Shelved ones are last. `total` does not count them; it includes those that are left out. It is
    None while the alarms of a site are not known.
    """
    every = list(sites)
    found = [
        {
            "site": site.site,
            "name": site.name or site.site,
            "is_live": site.is_live and archive.is_reachable,
            **alarm,
        }
        for site in every
        for alarm in site.alarms
    ]
    worst = heapq.nsmallest(
        MAX_LISTED, found, key=lambda alarm: (*worst_first(alarm), alarm["site"])
    )
    counts = [site.active_alarms for site in every if site.active_alarms is not None]
    return {"alarms": worst, "total": sum(counts) if len(counts) == len(every) else None}


def worst_first(alarm: Mapping[str, Any]) -> tuple[Any, ...]:
    """Sort key, as on the page of a greenhouse: by the verdict now, then what needs attention."""
    raised = alarm["raised_at"]
    return (
        "shelved_by" in alarm,
        ORDER[verdict_now(alarm)],
        "acknowledged_by" in alarm,
        *(-raised["sec"], -raised["nanosec"], alarm["id"]),
    )


class SitesFrame:
    """One overview for all browsers, whole or what differs from `base`; each serialized once."""

    def __init__(
        self,
        sites: Mapping[str, Site],
        archive: Archive,
        now_ns: int,
        base: SitesFrame | None = None,
    ) -> None:
        self.seq: int = 1 if base is None else base.seq + 1
        self.base = base
        self.sites = sites
        self.archive = archive
        self._now_ns = now_ns
        self._wires: dict[tuple[bool, tuple[str, ...]], bytes] = {}
        if base is not None:
            base.base = None

    def wire(self, sent_seq: int | None, only: tuple[str, ...] = ()) -> bytes:
        """The frame for a client that has the frame `sent_seq`: what differs from that, or all.

        `only` are the sites that it may read; empty: all.
        """
        base = self.base if self.base is not None and self.base.seq == sent_seq else None
        key = base is None, only
        if key not in self._wires:
            known: Mapping[str, object] = {}
            # If the archive has come or gone, every site is changed.
            if base is not None and base.archive == self.archive:
                known = {name: _lasting(site) for name, site in base.sites.items()}
            gone = [] if base is None else [it for it in base.sites if it not in self.sites]
            body = {
                "type": "sites",
                "is_whole": base is None,
                "archive": archive_json(self.archive),
                # A heartbeat alone is no change.
                "sites": [
                    site_json(site, self.archive, self._now_ns)
                    for name, site in self.sites.items()
                    if known.get(name) != _lasting(site) and (not only or name in only)
                ],
                "gone": [name for name in gone if not only or name in only],
            }
            self._wires[key] = text_frame(orjson.dumps(body))
        return self._wires[key]


def archive_json(archive: Archive) -> dict[str, Any]:
    """Whether the archive answers, and if not, why."""
    return {
        "is_reachable": archive.is_reachable,
        "message": archive.message,
        "since": stamp(archive.since_ns) if archive.since_ns else None,
    }
