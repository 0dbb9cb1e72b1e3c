"""The FastAPI application: every route, and the page.

`python -m lupin_bridge.app` writes its OpenAPI document, without a twin and without ROS.
"""

from __future__ import annotations

import sys
from functools import cache
from pathlib import Path

import orjson
from fastapi import FastAPI, Response, WebSocket
from starlette.requests import HTTPConnection
from starlette.staticfiles import StaticFiles

from lupin_bridge import __version__
from lupin_bridge.access.middleware import Access, AccessControl, ReadOnly
from lupin_bridge.access.policy import BehindProxies, Proxies
from lupin_bridge.bridge import Bridge
from lupin_bridge.metrics import Metered
from lupin_bridge.routes import export, field, pages, sockets, state, status, writes
from lupin_bridge.routes.answers import add_refusals, error_response
from lupin_bridge.stream import routes_schema, schema

STATIC_FOLDER = Path(__file__).parent / "static"
GUIDE_FOLDER = Path(__file__).parent / "guide"

# Every module whose `router` has routes.
ROUTED = (
    state,
    sockets,
    field,
    export,
    status,
    writes,
    pages,
)


def has_page(static_folder: Path = STATIC_FOLDER) -> bool:
    """Whether the page was built before the bridge was installed."""
    return (static_folder / "index.html").is_file()


def create_app(
    bridge: Bridge | None,
    static_folder: Path = STATIC_FOLDER,
    access: Access | None = None,
    proxies: Proxies | None = None,
    guide_folder: Path = GUIDE_FOLDER,
) -> FastAPI:
    """Build the application for a bridge; the caller starts and stops the bridge.

    Without a bridge it can only write its OpenAPI document. The default `access` accepts this
    machine's host names and needs no token. Without `proxies`, the client is the connected peer.
    """
    access = access or Access()
    app = FastAPI(
        title="lupin-twin",
        version=__version__,
        summary="Digital twin of a greenhouse: every tag's state, and fields of every sensor.",
        description=_DESCRIPTION,
        openapi_url=None,  # also no docs page of FastAPI, which loads scripts from the internet
    )
    app.state.bridge = bridge
    app.state.access = access
    # Not `include_router`: it copies each route, which adds 0.1 s to the first request.
    for module in ROUTED:
        app.router.routes.extend(module.router.routes)
    # The last one added runs first.
    app.add_middleware(ReadOnly)
    app.add_middleware(AccessControl, access=access)
    if bridge is not None:
        app.add_middleware(Metered, note=bridge.note_answer)
    app.add_middleware(BehindProxies, proxies=proxies or Proxies())
    app.add_exception_handler(404, _not_found)
    add_refusals(app)
    pages.add_guide(app, guide_folder)
    app.add_api_websocket_route("/{path:path}", _no_websocket)
    if has_page(static_folder):
        app.mount("/", StaticFiles(directory=static_folder, html=True), name="hmi")
    else:
        app.router.routes.extend(pages.no_page_router.routes)
    _describe_frames(app)
    return app


_DESCRIPTION = """
All routes are read-only (GET and HEAD), except those for sign-in, notes, push devices and
observations. Only `POST /api/observations` writes to ROS, and it is off by default. Positions are
metres in the map frame, values are in the sensor's unit, and unknown values are null. `/ws/state`
is a WebSocket that sends `StateFrame`, `StatusFrame`, `AlarmsFrame` and `RobotFrame` as JSON text:
the current ones on connection, then every change. A bridge with a token (`LUPIN_TOKEN`) requires it
as `Authorization: Bearer` with every request except `/healthz`; a browser signs in at `/signin`.
"""


async def _not_found(request: HTTPConnection, _error: Exception | None = None) -> Response:
    # Below a mount, `root_path` is the mount's own.
    prefix = request.scope.get("app_root_path", request.scope.get("root_path", ""))
    return error_response(f"there is nothing at {request.url.path[:128]!r}; see {prefix}/docs", 404)


async def _no_websocket(websocket: WebSocket) -> None:
    await websocket.send_denial_response(await _not_found(websocket))


FRAMES = (
    schema.StateFrame,
    schema.DeltaFrame,
    schema.StatusFrame,
    schema.AlarmsFrame,
    routes_schema.RobotFrame,
    schema.Alarms,
)


def _describe_frames(app: FastAPI) -> None:
    """Add the WebSocket frames, which OpenAPI has no place for, to the document's schemas.

    Take out FastAPI's own refusal: `add_refusals` makes it a 400.
    """
    plain = app.openapi

    @cache
    def with_frames() -> dict[str, object]:
        document = plain()
        schemas = document.setdefault("components", {}).setdefault("schemas", {})
        for name in ("HTTPValidationError", "ValidationError"):
            schemas.pop(name, None)
        for operation in (it for path in document["paths"].values() for it in path.values()):
            operation["responses"].pop("422", None)
        for model in FRAMES:
            described = model.model_json_schema(ref_template="#/components/schemas/{model}")
            schemas.update(described.pop("$defs", {}))
            schemas[model.__name__] = described
        return document

    app.openapi = with_frames  # type: ignore[method-assign]  # FastAPI's documented way


@cache
def document() -> bytes:
    """The OpenAPI document as indented JSON with a final newline."""
    options = orjson.OPT_INDENT_2 | orjson.OPT_APPEND_NEWLINE
    return orjson.dumps(create_app(None).openapi(), option=options)


if __name__ == "__main__":
    sys.stdout.buffer.write(document())
