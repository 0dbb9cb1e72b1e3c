"""Rows of many sites in one export."""

from __future__ import annotations

from collections.abc import AsyncGenerator, Awaitable, Callable, Iterable, Mapping
from contextlib import aclosing
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol

from fastapi import Request, Response
from starlette.requests import HTTPConnection

from lupin_bridge.feed.past_process import PastProcess
from lupin_bridge.feed.query import ExportStep, Now
from lupin_bridge.feed.source import exported
from lupin_bridge.fleet.compare import chosen
from lupin_bridge.fleet.overview import Site
from lupin_bridge.fleet.source import Watching
from lupin_bridge.judge.options import Criteria
from lupin_bridge.past import query as past_query
from lupin_bridge.past.bodies import COMPLETE_TO
from lupin_bridge.past.export import ExportFormat
from lupin_bridge.past.query import OfExport
from lupin_bridge.query_string import parameter
from lupin_bridge.routes.export import Exporting, end_of, respond_export
from lupin_twin.core.journal_condition import Condition, JournalState
from lupin_twin.core.past import seconds
from lupin_twin.journal.queries import STRETCH_S, Export


@dataclass(frozen=True, slots=True)
class OfSitesExport(OfExport):
    """The parameters of an export of many sites."""

    sites: str | None = parameter("names of sites, with a comma between; default: all")


class ExportingSites(Exporting, Protocol):
    """What has sites to export: the fleet."""

    watching: Watching
    past: PastProcess
    criteria: Criteria

    def sites_for(self, request: HTTPConnection) -> Mapping[str, Site]:
        """The sites that whoever makes a request may read."""


async def respond_sites(fleet: ExportingSites, kind: ExportFormat, request: Request) -> Response:
    """Every row of a period of the sites that are named, or of all."""
    period = past_query.period(OfSitesExport, request.query_params.multi_items(), None)
    known = fleet.sites_for(request)
    named = [known[name] for name in chosen(request.query_params.get("sites"), known)]
    end_ns = end_of(period, None)
    query = Export(period.start_ns, end_ns, period.tag_id, period.sensor_type)
    heard_ns = min((site.heard_ns for site in named), default=0)
    return await respond_export(
        request,
        fleet,
        lambda pack: _rows(fleet, [site.site for site in named], query, pack),
        kind,
        period,
        sensors=fleet.criteria.sensors,
        now_ns=fleet.watching.now_ns,
        known={COMPLETE_TO: seconds(min(heard_ns, end_ns))},
        has_site=True,
    )


async def _rows(
    fleet: ExportingSites, sites: Iterable[str], period: Export, pack: Callable[..., bytes]
) -> AsyncGenerator[bytes]:
    """The rows of one site after the other, see `exported`; each lot through `pack`."""
    for site in sites:
        log = Condition(JournalState.RECORDING, path=site, journal_id=site)
        now = Now(fleet.watching.now_ns, "", log)

        def ask(step: ExportStep[bytes], now: Now = now) -> Awaitable[Any]:
            return fleet.past.ask(step, now, STRETCH_S)

        async with aclosing(exported(ask, period, partial(pack, site=site))) as lots:
            async for lot in lots:
                yield lot
