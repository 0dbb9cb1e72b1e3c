"""The FastAPI application: every route, and the page."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from fastapi import FastAPI, Response, WebSocket
from starlette.requests import HTTPConnection
from starlette.staticfiles import StaticFiles

from lupin_bridge import __version__
from lupin_bridge.access.entrance import ComesIn, Entrance
from lupin_bridge.access.middleware import Access, AccessControl
from lupin_bridge.access.security import ReadOnly
from lupin_bridge.bridge import Bridge
from lupin_bridge.routes import alarms as routes_alarms
from lupin_bridge.routes import docs_page, guide, no_page
from lupin_bridge.routes import estimate as routes_estimate
from lupin_bridge.routes import estimate_report as routes_estimate_report
from lupin_bridge.routes import export as routes_export
from lupin_bridge.routes import field as routes_field
from lupin_bridge.routes import foxglove as routes_foxglove
from lupin_bridge.routes import health as routes_health
from lupin_bridge.routes import judge as routes_judge
from lupin_bridge.routes import map as routes_map
from lupin_bridge.routes import past as routes_past
from lupin_bridge.routes import rosbridge as routes_rosbridge
from lupin_bridge.routes import signin as routes_signin
from lupin_bridge.routes import state as routes_state
from lupin_bridge.routes.tools import error_response
from lupin_bridge.serving.goodbye import EndsWithTheBridge
from lupin_bridge.serving.http_protocol import PieceByPiece
from lupin_bridge.serving.metering import Metered
from lupin_bridge.stream import schema

STATIC_FOLDER = Path(__file__).parent / "static"
GUIDE_FOLDER = Path(__file__).parent / "guide"

# Every module whose `router` has routes.
ROUTED = (
    routes_state,
    routes_rosbridge,
    routes_foxglove,
    routes_field,
    routes_estimate,
    routes_estimate_report,
    routes_past,
    routes_export,
    routes_map,
    routes_judge,
    routes_alarms,
    routes_health,
    routes_signin,
    docs_page,
    guide,
)


def has_page(static_folder: Path = STATIC_FOLDER) -> bool:
    """Whether the page was built before the bridge was installed."""
    return (static_folder / "index.html").is_file()


def create_app(
    bridge: Bridge | None,
    static_folder: Path = STATIC_FOLDER,
    access: Access | None = None,
    entrance: Entrance | None = None,
    guide_folder: Path = GUIDE_FOLDER,
) -> FastAPI:
    """The application around a bridge that its caller starts and stops.

    Without a bridge it can only describe itself (OpenAPI). Without `access` it goes by the names
    of this machine, and asks for no token. Without `entrance`, who asks is who is connected.
    """
    access = access or Access()
    app = FastAPI(
        title="lupin-twin",
        version=__version__,
        summary="Digital twin of a greenhouse: every tag's state, and fields of every sensor.",
        description=_DESCRIPTION,
        docs_url=None,  # FastAPI's own page loads its scripts from the internet
        redoc_url=None,
        openapi_url=None,
    )
    app.state.bridge = bridge
    app.state.access = access
    for module in ROUTED:
        app.include_router(module.router)
    # The last one added is the first to be asked.
    if bridge is not None:
        app.add_middleware(PieceByPiece)
        app.add_middleware(EndsWithTheBridge, goodbye=bridge.goodbye)
    app.add_middleware(ReadOnly)
    app.add_middleware(AccessControl, access=access)
    app.add_middleware(ComesIn, entrance=entrance or Entrance())
    if bridge is not None:
        app.add_middleware(Metered, note=bridge.note_answer)
    app.add_exception_handler(404, _not_found)
    guide.add_to(app, guide_folder)
    app.add_api_websocket_route("/{path:path}", _no_websocket)
    if has_page(static_folder):
        app.mount("/", StaticFiles(directory=static_folder, html=True), name="hmi")
    else:
        app.include_router(no_page.router)
    _describe_frames(app)
    return app


_DESCRIPTION = """
Read-only: every route answers GET and HEAD alone (sign-in and sign-out of a browser: POST).
Positions are metres in the map frame, values are in the sensor's unit, what is not known is null.
`/ws/state` is a WebSocket that sends `StateFrame`, `StatusFrame` and `AlarmsFrame` as JSON text:
the current ones at once, then every change. A bridge with a token (`LUPIN_TOKEN`) wants it as
`Authorization: Bearer` with every request, `/healthz` excepted; a browser signs in at `/signin`.
"""


async def _not_found(request: HTTPConnection, _error: Exception | None = None) -> Response:
    # Of a path below a mount, `root_path` is the mount's.
    prefix = request.scope.get("app_root_path", request.scope.get("root_path", ""))
    return error_response(f"there is nothing at {request.url.path[:128]!r}; see {prefix}/docs", 404)


async def _no_websocket(websocket: WebSocket) -> None:
    await websocket.send_denial_response(await _not_found(websocket))


FRAMES = (
    schema.StateFrame,
    schema.DeltaFrame,
    schema.StatusFrame,
    schema.AlarmsFrame,
    schema.Alarms,
)


def _describe_frames(app: FastAPI) -> None:
    """Add the WebSocket frames, which OpenAPI has no place for, to the document's schemas."""
    plain = app.openapi

    @cache
    def with_frames() -> dict[str, object]:
        document = plain()
        schemas = document.setdefault("components", {}).setdefault("schemas", {})
        for model in FRAMES:
            described = model.model_json_schema(ref_template="#/components/schemas/{model}")
            schemas.update(described.pop("$defs", {}))
            schemas[model.__name__] = described
        return document

    app.openapi = with_frames  # type: ignore[method-assign]  # FastAPI's documented way
