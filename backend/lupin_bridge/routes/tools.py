"""Small parts that all routes share."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, TypeVar, cast

import orjson
from fastapi import APIRouter, Request, Response

from lupin_bridge.bridge import Bridge
from lupin_bridge.stream import schema

NOT_REMEMBERED: Final[dict[int | str, dict[str, Any]]] = {
    304: {"description": "the ETag still holds"},
    400: {"model": schema.ErrorMessage, "description": "refused; detail says why"},
    404: {"model": schema.ErrorMessage, "description": "nothing of the past is kept here"},
    429: {"model": schema.ErrorMessage, "description": "this client asks for too much"},
    503: {"model": schema.ErrorMessage, "description": "it cannot be read now, or too much is"},
    504: {"model": schema.ErrorMessage, "description": "it took too long"},
}


JSON_TYPE = "application/json"

# Browsers and proxies keep what they got, and ask each time whether it still holds.
REVALIDATE = {"Cache-Control": "no-cache"}
NEVER_KEEP = {"Cache-Control": "no-store"}

RouteT = TypeVar("RouteT", bound=Callable[..., Any])


def read_route(router: APIRouter, path: str, **documentation: Any) -> Callable[[RouteT], RouteT]:
    """Register a function for GET and, undocumented, for HEAD (the server drops the body)."""

    def register(function: RouteT) -> RouteT:
        router.get(path, response_class=Response, **documentation)(function)
        router.head(path, response_class=Response, include_in_schema=False)(function)
        return function

    return register


def bridge_of(request: Request) -> Bridge:
    """The application's bridge."""
    return cast("Bridge", request.app.state.bridge)


def list_header(request: Request, name: str) -> str:
    """All lines of a header that is a list, as one (RFC 9110, section 5.3)."""
    return ", ".join(request.headers.getlist(name))


def json_response(
    body: bytes, status_code: int = 200, headers: dict[str, str] | None = None
) -> Response:
    """JSON that is already text; never kept by anyone unless the headers say so."""
    return Response(body, status_code, headers or NEVER_KEEP, JSON_TYPE)


def error_response(
    detail: str, status_code: int, headers: dict[str, str] | None = None
) -> Response:
    """`schema.ErrorMessage`."""
    return json_response(orjson.dumps({"detail": detail}), status_code, headers)
