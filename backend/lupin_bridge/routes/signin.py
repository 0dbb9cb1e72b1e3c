"""Signing in with a browser: a small page, and the exchange of the token for a session cookie."""

from __future__ import annotations

import time
from functools import cache
from pathlib import Path
from typing import Final

from fastapi import APIRouter, Request, Response

from lupin_bridge.access.credentials import SESSION_S
from lupin_bridge.access.middleware import Access
from lupin_bridge.routes.tools import NEVER_KEEP, REVALIDATE, error_response, read_route

router = APIRouter()

# Not in the folder of the HMI, which its build empties, and needed before the HMI may be read.
_FOLDER: Final = Path(__file__).parent / "signin_page"


@read_route(router, "/api/signin", include_in_schema=False)
async def sign_in(request: Request) -> Response:
    """Trade the token, which `AccessControl` has looked at, for a session cookie.

    For the page below: programs send `Authorization: Bearer` with every request instead.
    """
    access = _access_of(request)
    if access.credentials is None:
        return error_response("this bridge asks for no token: there is nothing to sign in to", 404)
    if "authorization" not in request.headers:  # a session must not renew itself
        return error_response(
            "send the token as Authorization: Bearer", 401, {"WWW-Authenticate": "Bearer"}
        )
    response = Response(status_code=204, headers=NEVER_KEEP)
    response.set_cookie(
        access.credentials.cookie_name,
        access.credentials.cookie(time.time()),
        max_age=SESSION_S,
        path=f"{request.scope.get('root_path', '')}/",
        secure=request.scope["scheme"] == "https",
        httponly=True,
        samesite="strict",
    )
    return response


@read_route(router, "/signin", include_in_schema=False)
async def page(request: Request) -> Response:
    """The page; where no token is asked for, on to the HMI."""
    if _access_of(request).credentials is None:
        return Response(status_code=303, headers={"Location": "./", **NEVER_KEEP})
    return _file("signin.html", "text/html; charset=utf-8")


@read_route(router, "/signin.css", include_in_schema=False)
async def style() -> Response:
    """The page's style."""
    return _file("signin.css", "text/css; charset=utf-8")


@read_route(router, "/signin.js", include_in_schema=False)
async def script() -> Response:
    """The page's script."""
    return _file("signin.js", "text/javascript; charset=utf-8")


def _access_of(request: Request) -> Access:
    access: Access = request.app.state.access
    return access


def _file(name: str, media_type: str) -> Response:
    return Response(_read(name), headers=REVALIDATE, media_type=media_type)


@cache
def _read(name: str) -> bytes:
    return (_FOLDER / name).read_bytes()
