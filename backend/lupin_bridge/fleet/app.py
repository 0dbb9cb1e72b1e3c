"""The fleet's application: the overview and, below `/sites/`, each site's own, made when opened."""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import AsyncGenerator, Awaitable, Callable, Iterable, Iterator, Mapping
from contextlib import aclosing
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Final, cast

import orjson
from fastapi import FastAPI, Request, Response, WebSocket
from fastapi.responses import FileResponse
from starlette.requests import HTTPConnection
from starlette.staticfiles import StaticFiles

from lupin_bridge import __version__
from lupin_bridge.access.middleware import Access, AccessControl, ReadOnly, client_of
from lupin_bridge.access.policy import BehindProxies, Proxies
from lupin_bridge.app import STATIC_FOLDER, create_app
from lupin_bridge.bridge import Bridge
from lupin_bridge.feed.past_process import PastProcess
from lupin_bridge.feed.query import Now, PastQuery
from lupin_bridge.feed.source import exported
from lupin_bridge.feed.tasks import Periodic, Shared
from lupin_bridge.fleet.compare import (
    COMPARE_S,
    Compare,
    OfCompare,
    OfSites,
    OfSitesReport,
    SitesReport,
    chosen,
    compare,
    sites_report,
)
from lupin_bridge.fleet.overview import (
    Site,
    SitesFrame,
    alarms_json,
    archive_json,
    map_version,
    site_json,
)
from lupin_bridge.fleet.pages import Opened, SitePage, SitePages, Sites
from lupin_bridge.fleet.source import SiteTwin, Watching
from lupin_bridge.judge.judging import Criteria
from lupin_bridge.metrics import CONTENT_TYPE
from lupin_bridge.past.bodies import COMPLETE_TO
from lupin_bridge.past.export import Csv, Parquet
from lupin_bridge.query_string import OfExport, parameter, read
from lupin_bridge.routes import pages, status
from lupin_bridge.routes.answers import (
    NEVER_STORE,
    ApiRoute,
    add_refusals,
    error_response,
    has_etag,
    json_response,
    not_modified,
    person_of,
    read_route,
    respond,
)
from lupin_bridge.routes.export import Format, respond_export, span_of
from lupin_bridge.routes.sockets import listen
from lupin_bridge.serving.admission import (
    REVALIDATE,
    Admission,
    Answer,
    AnswerCache,
    Limits,
    content_answer,
)
from lupin_bridge.settings import Settings
from lupin_bridge.stream.frames import Status
from lupin_bridge.stream.hub import Hub
from lupin_twin.core.diagnostics import UNKNOWN_JOURNAL, Condition, JournalState
from lupin_twin.core.past import seconds
from lupin_twin.journal.writes import STRETCH_S, Export
from lupin_twin.runtime.workers import Workers

_TIDY_S: Final = 5.0
# Limit of the cached answers of one site.
_CACHE_BYTES: Final = 4_000_000
# Least, and greatest, time between two frames to a browser.
_FRAME_S: Final = 1.0
_HEARTBEAT_S: Final = 3.0
# The routes for signing in, and of the sensors in force.
_AS_EVERYWHERE: Final = frozenset(
    {
        *("/api/signin", "/api/signout", "/api/session", "/signin", "/signin.css", "/signin.js"),
        *("/font.woff2", "/api/sensors"),
    }
)


# A picture that is opened by itself may use its own styles, and nothing else.
_PICTURE_POLICY: Final = "default-src 'none'; style-src 'unsafe-inline'; frame-ancestors 'none'"


class Fleet:
    """Everything between the archive and the browsers. Belongs to the event loop."""

    def __init__(
        self, settings: Settings, criteria: Criteria, access: Access, limits: Limits
    ) -> None:
        self.watching = Watching(settings)
        self.past = PastProcess("lupin_bridge.fleet.reader")
        self.hub = Hub(
            settings.max_clients, limits.client_timeout_s, lambda _: Status("live", None)
        )
        self.criteria, self.limits = criteria, limits
        # One for all sites: a client's limits do not grow with the number of sites.
        self.admission = Admission(limits)
        self.workers = Workers("work")

        def make(name: str) -> Opened:
            source = SiteTwin(name, self.watching, self.past, self.workers, limits.answer_timeout_s)
            bridge = Bridge(
                source,
                replace(settings, site=name),
                criteria=criteria,
                limits=limits,
                admission=self.admission,
                cache=AnswerCache(_CACHE_BYTES),
            )
            # Readers have been checked before they get here; the routes check who writes.
            app = create_app(bridge, access=Access(access.policy))
            app.state.access = access
            ready = asyncio.create_task(bridge.start(), name=f"open {name}")
            return Opened(bridge, app, ready)

        self.pages = SitePages(make, lambda: self.watching.sites, limits.open_sites)
        # `routes.answers` needs these, as it does of a bridge.
        self.cache = AnswerCache()
        self.answering = Shared()
        self._frame = SitesFrame(self.watching.sites, self.watching.archive, 0)
        self._framed_s = -math.inf
        self._pushing = Periodic(self._push, _FRAME_S, "the overview", 0.0)
        self._tidying = Periodic(self._tidy, _TIDY_S, "tidying")

    async def start(self) -> None:
        """Start watching the archive."""
        self.watching.start()
        self._pushing.start()
        self._tidying.start()

    async def stop(self) -> None:
        """Close every page, and stop."""
        await self._pushing.stop()
        await self._tidying.stop()
        await self.pages.close()
        self.workers.close()
        await asyncio.gather(self.watching.stop(), self.past.stop())

    def announce_shutdown(self) -> None:
        """Notify every client that the fleet is shutting down."""
        for opened in self.pages:
            opened.bridge.announce_shutdown()

    # --- the overview -------------------------------------------------------------------------

    def sites_for(self, request: HTTPConnection) -> Mapping[str, Site]:
        """The sites that the person of a request may read."""
        person, sites = person_of(request), self.watching.sites
        if person is None or not person.sites:
            return sites
        return {name: site for name, site in sites.items() if person.reads(name)}

    async def _push(self) -> None:
        now_s, watching, last = time.monotonic(), self.watching, self._frame
        is_same = last.sites is watching.sites and last.archive is watching.archive
        if is_same and now_s - self._framed_s < _HEARTBEAT_S:
            return
        self._framed_s = now_s
        self._frame = SitesFrame(watching.sites, watching.archive, watching.now_ns, last)
        self.hub.publish(self._frame, now_s)  # type: ignore[arg-type]  # all that the hub needs of one

    async def _tidy(self) -> None:
        now_s = time.monotonic()
        self.pages.tidy(now_s)
        self.hub.dismiss_stuck(now_s)

    def measure(self) -> Iterator[tuple[str, str, float]]:
        """Yield (name, help text, value) of each metric, for Prometheus."""
        watching = self.watching
        yield "lupin_fleet_sites", "sites in the archive", len(watching.sites)
        live = sum(site.is_live for site in watching.sites.values())
        is_reachable = watching.archive.is_reachable
        yield "lupin_fleet_sites_live", "live sites", live if is_reachable else 0
        yield "lupin_fleet_archive_reachable", "1 while the archive answers", is_reachable
        yield "lupin_fleet_looks", "queries of the archive for changes", watching.looks
        starts = watching.process.starts
        yield "lupin_fleet_watcher_starts", "starts of the process that queries the archive", starts
        starts = self.past.starts
        yield "lupin_fleet_reader_starts", "starts of the process that reads sites", starts
        yield "lupin_fleet_sites_open", "sites whose page is open here", len(self.pages)
        yield "lupin_clients", "WebSocket clients that follow the overview", len(self.hub)
        dismissed = self.hub.clients_dismissed
        yield "lupin_clients_dismissed", "clients disconnected: they accepted no frame", dismissed


@dataclass(frozen=True, slots=True)
class OfSitesExport(OfExport):
    """The parameters of an export of many sites."""

    sites: str | None = parameter("names of sites, separated by commas; default: all")


@dataclass(frozen=True, slots=True)
class OfPicture:
    """The parameter of `/api/sites/{name}/map.svg`."""

    v: str | None = parameter("ignored: a new one keeps a browser from showing an old picture")


async def respond_sites(fleet: Fleet, kind: Format, request: Request) -> Response:
    """Every row of a period, of the named sites or of all."""
    given = read(OfSitesExport, request.query_params.multi_items())
    known = fleet.sites_for(request)
    named = [known[name] for name in chosen(given.sites, known)]
    start_ns, end_ns = span_of(given, None)
    query = Export(start_ns, end_ns, given.tag_id, given.sensor_type)
    heartbeat_ns = min((site.heartbeat_ns for site in named), default=0)
    return await respond_export(
        request,
        fleet,
        lambda pack: _rows(fleet, [site.site for site in named], query, pack),
        kind,
        given,
        now_ns=fleet.watching.now_ns,
        known={COMPLETE_TO: seconds(min(heartbeat_ns, end_ns))},
        has_site=True,
    )


async def _rows(
    fleet: Fleet, sites: Iterable[str], period: Export, pack: Callable[..., bytes]
) -> AsyncGenerator[bytes]:
    """The rows of one site after the other, see `exported`; each lot through `pack`."""
    for site in sites:
        log = Condition(JournalState.RECORDING, path=site, journal_id=site)
        now = Now(fleet.watching.now_ns, "", log)

        def ask(step: PastQuery[Any], now: Now = now) -> Awaitable[Any]:
            return fleet.past.ask(step, now, STRETCH_S)

        async with aclosing(exported(ask, period, partial(pack, site=site))) as lots:
            async for lot in lots:
                yield lot


def create_fleet_app(
    fleet: Fleet,
    access: Access,
    proxies: Proxies,
) -> FastAPI:
    """Build the application for a fleet; the caller starts and stops the fleet."""
    app = FastAPI(title="lupin-twin fleet", version=__version__, openapi_url=None)
    app.state.access = access
    app.state.bridge = fleet
    app.router.route_class = ApiRoute
    add_refusals(app)
    _add_overview(app, fleet)
    _add_answers(app, fleet)
    _add_probes(app, fleet)
    every = (*pages.router.routes, *status.router.routes)
    app.router.routes.extend(it for it in every if getattr(it, "path", "") in _AS_EVERYWHERE)
    # The last one added runs first.
    app.add_middleware(ReadOnly)
    app.add_middleware(Sites, pages=fleet.pages, page=SitePage(STATIC_FOLDER))
    app.add_middleware(AccessControl, access=access)
    app.add_middleware(BehindProxies, proxies=proxies)
    page = STATIC_FOLDER / "fleet.html"

    @app.get("/", include_in_schema=False)
    async def overview() -> Response:
        if not page.is_file():
            return error_response("the page was not built; /api/sites has the overview", 404)
        return FileResponse(page, headers=REVALIDATE)

    @app.get("/lupin.svg", include_in_schema=False)
    async def icon() -> Response:
        return FileResponse(STATIC_FOLDER / "lupin.svg")

    # Not all of the folder: beside it is the page of one greenhouse.
    if page.is_file():
        app.mount("/assets", StaticFiles(directory=STATIC_FOLDER / "assets"), name="assets")
    app.add_exception_handler(404, _not_found)
    return app


async def _not_found(request: Request, _error: Exception) -> Response:
    return error_response(f"there is nothing at {request.url.path[:128]!r}", 404)


def _add_overview(app: FastAPI, fleet: Fleet) -> None:
    @read_route(app.router, "/api/sites")
    async def overview(request: Request) -> Response:
        """Every site of the archive, by name."""
        sites, archive = fleet.sites_for(request), fleet.watching.archive
        now_ns = fleet.watching.now_ns
        entries = [site_json(site, archive, now_ns) for site in sites.values()]
        return json_response(orjson.dumps({"sites": entries}), 200)

    @read_route(app.router, "/api/sites/{name}/map.svg", OfPicture)
    async def site_map(request: Request, name: str) -> Response:
        """A picture of where the tags of a site are, and of their verdicts."""
        read(OfPicture, request.query_params.multi_items())
        site = fleet.watching.sites.get(name)
        if site is None or not site.dots:
            return error_response(f"there is no map of a site {name[:64]!r}", 404)
        tag = f'"{map_version(site.dots)}"'
        if has_etag(request, tag):
            return not_modified(tag)
        headers = {"ETag": tag, **REVALIDATE, "Content-Security-Policy": _PICTURE_POLICY}
        return Response(site.dots, 200, headers, "image/svg+xml")

    @app.websocket("/ws/sites")
    async def ws_sites(websocket: WebSocket) -> None:
        """Every site at once, then what has changed; input is ignored."""
        await websocket.accept()
        person = person_of(websocket)
        only = () if person is None else person.sites
        await listen(
            websocket,
            fleet.hub,
            delta=True,
            wants=("state",),
            wire=lambda it, frame: cast("SitesFrame", frame).wire(it.sent_seq, only),
        )


def _add_answers(app: FastAPI, fleet: Fleet) -> None:
    """Routes over several sites at once."""
    for kind in (Csv, Parquet):
        export = partial(respond_sites, fleet, kind)
        read_route(app.router, f"/api/export.{kind.name}", OfSitesExport)(export)

    @read_route(app.router, "/api/alarms", OfSites)
    async def alarms(request: Request) -> Response:
        """Active alarms of all sites, the worst first."""
        given = read(OfSites, request.query_params.multi_items())
        watching = fleet.watching
        names = chosen(given.sites, fleet.sites_for(request))
        key = ("alarms", watching.looks, watching.archive.is_reachable, *names)

        async def compute() -> Answer:
            with fleet.admission.computing(client_of(request)):
                body = alarms_json((watching.sites[name] for name in names), watching.archive)
                answer = content_answer(orjson.dumps(body))
            fleet.cache.put(key, answer)
            return answer

        return await respond(request, key, compute)

    @read_route(app.router, "/api/compare", OfCompare)
    async def compared(request: Request) -> Response:
        """One sensor of several sites."""
        watching = fleet.watching
        names = {site: it.name or site for site, it in fleet.sites_for(request).items()}
        parameters = request.query_params.multi_items()
        return await over_sites(
            request, compare(parameters, names, watching.now_ns, fleet.criteria.sensors)
        )

    @read_route(app.router, "/api/report", OfSitesReport)
    async def reported(request: Request) -> Response:
        """A row for each site, with its counts and the address of its report; the newest notes."""
        parameters, now_ns = request.query_params.multi_items(), fleet.watching.now_ns
        return await over_sites(request, sites_report(parameters, fleet.sites_for(request), now_ns))

    async def over_sites(request: Request, query: Compare | SitesReport) -> Response:
        about = Now(0, "", UNKNOWN_JOURNAL)

        async def compute() -> Answer:
            with fleet.admission.computing(client_of(request), is_large=True):
                return await fleet.past.ask(query, about, COMPARE_S)

        return await respond(request, query, compute)


def _add_probes(app: FastAPI, fleet: Fleet) -> None:
    @read_route(app.router, "/healthz")
    async def healthz() -> Response:
        """The process is alive, whatever becomes of the archive."""
        return json_response(orjson.dumps({"ok": True, "message": "The fleet's page is served."}))

    @read_route(app.router, "/readyz")
    async def readyz() -> Response:
        """503 while the archive does not answer."""
        archive = fleet.watching.archive
        body = {**archive_json(archive), "sites": len(fleet.watching.sites)}
        return json_response(orjson.dumps(body), 200 if archive.is_reachable else 503)

    @read_route(app.router, "/metrics")
    async def metrics() -> Response:
        """In Prometheus' text format."""
        lines = [
            f"# HELP {name} {what}\n# TYPE {name} gauge\n{name} {float(value):g}\n"
            for name, what, value in fleet.measure()
        ]
        return Response("".join(lines), 200, NEVER_STORE, CONTENT_TYPE)
