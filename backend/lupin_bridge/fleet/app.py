"""The fleet's application: the overview, and below `/sites/` each site's own, made when opened."""

from __future__ import annotations

import asyncio
import logging
import math
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import orjson
from fastapi import FastAPI, Request, Response, WebSocket
from fastapi.responses import FileResponse
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp, Receive, Scope, Send

from lupin_bridge import __version__
from lupin_bridge.access.middleware import Access, AccessControl, ReadOnly, client_of
from lupin_bridge.access.policy import BehindProxies, Proxies
from lupin_bridge.app import STATIC_FOLDER, create_app
from lupin_bridge.bridge import Bridge
from lupin_bridge.feed.past_process import PastProcess
from lupin_bridge.field import query as field_query
from lupin_bridge.fleet.overview import SitesFrame, archive_json, etag, site_json
from lupin_bridge.fleet.source import SiteTwin
from lupin_bridge.fleet.watching import Watching
from lupin_bridge.judge.options import Criteria
from lupin_bridge.metrics import CONTENT_TYPE
from lupin_bridge.routes import pages
from lupin_bridge.routes.answers import (
    NEVER_STORE,
    add_refusals,
    error_response,
    json_response,
    list_header,
)
from lupin_bridge.routes.sockets import has_place, next_message
from lupin_bridge.serving.admission import REVALIDATE, Limits
from lupin_bridge.serving.middleware import EndsAtShutdown, PieceByPiece, Shutdown
from lupin_bridge.serving.ws_protocol import CONNECTION_KEY, Connection
from lupin_bridge.settings import Settings
from lupin_bridge.stream.hub import Client, Hub
from lupin_bridge.stream.status import Status

log = logging.getLogger(__name__)

# Sites whose pages are open at once in this process; each is some megabytes.
MAX_OPEN: Final = 50
# A page that nobody has asked anything of for so long, and that nobody follows, is closed.
_IDLE_S: Final = 120.0
_TIDY_S: Final = 5.0
# No browser gets more frames than one in so many seconds; and one at least in so many.
_FRAME_S: Final = 1.0
_HEARTBEAT_S: Final = 5.0
_PREFIX: Final = "/sites/"
# What a browser signs in by, as everywhere.
_SIGN_IN: Final = frozenset(
    {"/api/signin", "/api/signout", "/api/session", "/signin", "/signin.css", "/signin.js"}
)


@dataclass(slots=True, eq=False)
class _Open:
    """A site's page: its bridge and its application, as if it were the only one."""

    source: SiteTwin
    bridge: Bridge
    app: ASGIApp
    ready: asyncio.Task[None]
    used_s: float = field(default_factory=time.monotonic)
    in_use: int = 0


class Fleet:
    """Everything between the archive and the browsers. Belongs to the event loop."""

    def __init__(
        self,
        settings: Settings,
        criteria: Criteria,
        access: Access,
        *,
        limits: Limits = Limits(),
    ) -> None:
        self.watching = Watching(settings, self._on_news)
        self.past = PastProcess("lupin_bridge.fleet.reader")
        self.shutdown = Shutdown()
        self.hub = Hub(
            settings.max_clients, limits.client_timeout_s, lambda _: Status("live", None)
        )
        self._settings, self._criteria, self._access = settings, criteria, access
        self._limits = limits
        self._open: dict[str, _Open] = {}
        self._frame: SitesFrame | None = None
        self._framed_s = -math.inf
        self._push_timer: asyncio.TimerHandle | None = None
        self._tidying: asyncio.Task[None] | None = None

    async def start(self) -> None:
        """Begin to watch the archive."""
        self.watching.start()
        self.past.start()
        self._tidying = asyncio.create_task(self._tidy(), name="tidy")

    async def stop(self) -> None:
        """Close every page, and end."""
        if self._push_timer is not None:
            self._push_timer.cancel()
        if self._tidying is not None:
            self._tidying.cancel()
            await asyncio.wait((self._tidying,))
        await asyncio.gather(*(self._close(name) for name in list(self._open)))
        await asyncio.gather(self.watching.stop(), self.past.stop())

    def announce_shutdown(self) -> None:
        """Tell every client that this is about to go."""
        for opened in self._open.values():
            opened.bridge.announce_shutdown()
        self.shutdown.begin()

    # --- the overview -------------------------------------------------------------------------

    def body(self) -> bytes:
        """`/api/sites`."""
        watching = self.watching
        now_ns = watching.now_ns
        return orjson.dumps(
            {
                "sites": [
                    site_json(site, watching.archive, now_ns) for site in watching.sites.values()
                ]
            }
        )

    def join(self, client: Client) -> None:
        """Add a browser; it has every site when this returns."""
        self._push_now()
        self.hub.join(client, time.monotonic())

    def _on_news(self) -> None:
        for opened in self._open.values():
            opened.source.on_news()
        if self._push_timer is None:
            wait_s = max(0.0, self._framed_s + _FRAME_S - time.monotonic())
            self._push_timer = asyncio.get_running_loop().call_later(wait_s, self._push)

    def _push(self) -> None:
        self._push_timer = None
        now_s = time.monotonic()
        self._framed_s = now_s
        watching = self.watching
        self._frame = SitesFrame(watching.sites, watching.archive, watching.now_ns, self._frame)
        self.hub.publish(self._frame, now_s)  # type: ignore[arg-type]  # all that the hub needs of one

    def _push_now(self) -> None:
        if self._frame is None:
            self._push()

    # --- the pages of sites -------------------------------------------------------------------

    async def page_of(self, name: str) -> _Open | str:
        """The site's page, made if need be; or why there is none."""
        opened = self._open.get(name)
        if opened is None:
            if name not in self.watching.sites:
                known = len(self.watching.sites)
                return f"there is no site {name[:64]!r} in the archive ({known} others are)"
            if len(self._open) >= MAX_OPEN:
                idle = [it for it in self._open.items() if not it[1].in_use]
                if not idle:
                    return f"{MAX_OPEN} sites are open here, the limit: try again later"
                await self._close(min(idle, key=lambda it: it[1].used_s)[0])
            opened = self._open[name] = self._make(name)
        opened.used_s = time.monotonic()
        await asyncio.shield(opened.ready)
        return opened

    def _make(self, name: str) -> _Open:
        source = SiteTwin(name, self.watching, self.past, self._limits.answer_timeout_s)
        bridge = Bridge(source, self._settings, criteria=self._criteria, limits=self._limits)
        # Who may read has been looked at by then.
        app = create_app(bridge, access=Access(self._access.policy))
        ready = asyncio.create_task(bridge.start(), name=f"open {name}")
        return _Open(source, bridge, app, ready)

    async def _close(self, name: str) -> None:
        opened = self._open.pop(name)
        opened.bridge.announce_shutdown()
        await asyncio.wait((opened.ready,))
        await opened.bridge.stop()

    async def _tidy(self) -> None:
        while True:
            await asyncio.sleep(_TIDY_S)
            try:
                now_s = time.monotonic()
                for name, opened in list(self._open.items()):
                    if not opened.in_use and now_s - opened.used_s >= _IDLE_S:
                        await self._close(name)
                self.hub.dismiss_stuck(now_s)
                if now_s - self._framed_s >= _HEARTBEAT_S and self._push_timer is None:
                    self._push()
            except Exception:  # nobody waits for this task
                log.exception("a page was not closed")

    def measure(self) -> Iterator[tuple[str, str, float]]:
        """What Prometheus reads: a name, what it is, the number."""
        watching = self.watching
        yield "lupin_fleet_sites", "sites in the archive", len(watching.sites)
        live = sum(site.is_live for site in watching.sites.values())
        is_reachable = watching.archive.is_reachable
        yield "lupin_fleet_sites_live", "sites that are live", live if is_reachable else 0
        yield "lupin_fleet_archive_reachable", "1 while the archive answers", is_reachable
        yield "lupin_fleet_looks", "looks at the archive since the start", watching.looks
        yield "lupin_fleet_sites_open", "sites whose page is open here", len(self._open)
        yield "lupin_clients", "WebSocket clients that follow the overview", len(self.hub)


class Sites:
    """ASGI: what is below `/sites/NAME` goes to that site's application, as if below a prefix."""

    def __init__(self, app: ASGIApp, fleet: Fleet) -> None:
        self._app = app
        self._fleet = fleet

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on to its site, or to the overview."""
        root = scope.get("root_path", "")
        path = scope.get("path", "")[len(root) :]
        if scope["type"] not in ("http", "websocket") or not path.startswith(_PREFIX):
            await self._app(scope, receive, send)
            return
        name, slash, _ = path[len(_PREFIX) :].partition("/")
        found = await self._fleet.page_of(name)
        if isinstance(found, str):
            status = 503 if name in self._fleet.watching.sites else 404
            await _refuse(found, status, scope, receive, send)
            return
        if not slash:
            # Relative, as all links are: below whatever prefix this is.
            await Response(status_code=307, headers={"location": f"{name}/"})(scope, receive, send)
            return
        found.in_use += 1
        try:
            own = {**scope, "root_path": f"{root}{_PREFIX}{name}"}
            own.pop("app_root_path", None)
            await found.app(own, receive, send)
        finally:
            found.in_use -= 1
            found.used_s = time.monotonic()


async def _refuse(detail: str, status: int, scope: Scope, receive: Receive, send: Send) -> None:
    response = error_response(detail, status)
    if scope["type"] == "websocket":
        await WebSocket(scope, receive, send).send_denial_response(response)
        return
    await response(scope, receive, send)


def create_fleet_app(
    fleet: Fleet,
    access: Access,
    proxies: Proxies,
    static_folder: Path = STATIC_FOLDER,
) -> FastAPI:
    """The application around a fleet that its caller starts and stops."""
    app = FastAPI(
        title="lupin-twin fleet",
        version=__version__,
        docs_url=None,
        redoc_url=None,
        openapi_url=None,
    )
    app.state.access = access
    _add_routes(app, fleet)
    signin = (route for route in pages.router.routes if getattr(route, "path", "") in _SIGN_IN)
    app.router.routes.extend(signin)
    # The last one added is the first to be asked.
    app.add_middleware(Sites, fleet=fleet)
    app.add_middleware(PieceByPiece)
    app.add_middleware(EndsAtShutdown, shutdown=fleet.shutdown)
    app.add_middleware(ReadOnly)
    app.add_middleware(AccessControl, access=access)
    app.add_middleware(BehindProxies, proxies=proxies)
    page = static_folder / "fleet.html"

    @app.get("/", include_in_schema=False)
    async def overview() -> Response:
        if not page.is_file():
            return error_response("the page was not built; /api/sites has the overview", 404)
        return FileResponse(page, headers=REVALIDATE)

    @app.get("/lupin.svg", include_in_schema=False)
    async def icon() -> Response:
        return FileResponse(static_folder / "lupin.svg")

    # Not all of the folder: beside it is the page of one greenhouse.
    if page.is_file():
        app.mount("/assets", StaticFiles(directory=static_folder / "assets"), name="assets")
    app.add_exception_handler(404, _not_found)
    add_refusals(app)
    return app


async def _not_found(request: Request, _error: Exception) -> Response:
    return error_response(f"there is nothing at {request.url.path[:128]!r}", 404)


def _add_routes(app: FastAPI, fleet: Fleet) -> None:
    @app.api_route("/api/sites", methods=["GET", "HEAD"])
    async def sites(request: Request) -> Response:
        """Every site of the archive, by name."""
        watching = fleet.watching
        tag = etag(watching.sites, watching.archive)
        if field_query.matches(list_header(request, "if-none-match"), tag.removeprefix("W/")):
            return Response(status_code=304, headers={"ETag": tag, **REVALIDATE})
        return json_response(fleet.body(), 200, {"ETag": tag, **REVALIDATE})

    @app.websocket("/ws/sites")
    async def ws_sites(websocket: WebSocket) -> None:
        """Every site at once, then what has changed; a client is not listened to."""
        await websocket.accept()
        if not await has_place(websocket, fleet.hub):
            return
        connection: Connection = getattr(websocket.state, CONNECTION_KEY)
        client = Client(
            connection,
            address=client_of(websocket),
            delta=True,
            wants_status=False,
            wants_alarms=False,
        )
        connection.on_writable = lambda: fleet.hub.serve(client, time.monotonic())
        fleet.join(client)
        try:
            while await next_message(websocket) is not None:
                pass
        finally:
            connection.on_writable = None
            fleet.hub.leave(client)

    @app.api_route("/healthz", methods=["GET", "HEAD"])
    async def healthz() -> Response:
        """The process is alive, whatever becomes of the archive."""
        return json_response(orjson.dumps({"ok": True, "message": "The fleet's page is served."}))

    @app.api_route("/readyz", methods=["GET", "HEAD"])
    async def readyz() -> Response:
        """503 while the archive does not answer."""
        archive = fleet.watching.archive
        body = {**archive_json(archive), "sites": len(fleet.watching.sites)}
        return json_response(orjson.dumps(body), 200 if archive.is_reachable else 503)

    @app.api_route("/metrics", methods=["GET", "HEAD"])
    async def metrics() -> Response:
        """In Prometheus' text format."""
        lines = [
            f"# HELP {name} {what}\n# TYPE {name} gauge\n{name} {float(value):g}\n"
            for name, what, value in fleet.measure()
        ]
        return Response("".join(lines), 200, NEVER_STORE, CONTENT_TYPE)
