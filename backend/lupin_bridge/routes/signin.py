"""Signing in with a browser, and out: a small page, and the token for a session's cookie."""

from __future__ import annotations

import re
import secrets
import time
from collections.abc import Collection
from functools import cache
from html import escape
from pathlib import Path
from typing import Final, Literal, TypedDict

import orjson
from fastapi import APIRouter, Request, Response

from lupin_bridge.access.credentials import SESSION_S, BrowserSession
from lupin_bridge.access.middleware import SESSION_KEY, Access
from lupin_bridge.routes.tools import (
    NEVER_KEEP,
    REVALIDATE,
    error_response,
    json_response,
    list_header,
    read_route,
)
from lupin_bridge.stream import schema

# RFC 9110, section 12.5.4; what is no weight counts as 1, which is what browsers leave out.
_WEIGHT: Final = re.compile(r";\s*q=(0(?:\.\d{0,3})?)\s*$")


def language_of(asked: str | None, accepted: str, spoken: Collection[str]) -> str:
    """One of `spoken`: what `?lang=` asks for, else the best of `Accept-Language`, else English.

    As in the HMI, "de-AT" and "DE" are German, and who asks for what is not spoken gets English.
    """
    if asked is not None:
        return _of(asked, spoken) or "en"
    found = "en", 0.0
    for part in accepted.split(","):
        language = _of(part.partition(";")[0], spoken)
        weight = _WEIGHT.search(part)
        share = 1.0 if weight is None else float(weight.group(1))
        if language is not None and share > found[1]:  # of equals the first
            found = language, share
    return found[0]


def _of(tag: str, spoken: Collection[str]) -> str | None:
    name = tag.strip().partition("-")[0].lower()
    return name if name in spoken else None


router = APIRouter()

# Not in the folder of the HMI, which its build empties, and needed before the HMI may be read.
_FOLDER: Final = Path(__file__).parent / "signin_page"


@router.post("/api/signin", include_in_schema=False)
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
        access.credentials.cookie(secrets.token_hex(16), time.time()),
        max_age=SESSION_S,
        **_place_of(request),
    )
    return response


@router.post("/api/signout", include_in_schema=False)
async def sign_out(request: Request) -> Response:
    """End the session that the request comes with, and everything that it has open."""
    access = _access_of(request)
    if access.credentials is None:
        return error_response("this bridge asks for no token: there is nothing to sign out of", 404)
    session = _session_of(request)
    if session is not None:
        access.sessions.sign_out(session, time.time())
    response = Response(status_code=204, headers=NEVER_KEEP)
    response.delete_cookie(access.credentials.cookie_name, **_place_of(request))
    return response


@read_route(
    router,
    "/api/session",
    summary="Is this a session that can be signed out of?",
    responses={200: {"model": schema.Session}},
)
async def session_route(request: Request) -> Response:
    """Whether the request came with a session, and how long that still lasts."""
    session = _session_of(request)
    left_s = None if session is None else max(0.0, session.ends_s - time.time())
    body = {"can_sign_out": session is not None, "seconds_left": left_s}
    return json_response(orjson.dumps(body))


@read_route(router, "/signin", include_in_schema=False)
async def page(request: Request) -> Response:
    """The page; where no token is asked for, on to the HMI."""
    if _access_of(request).credentials is None:
        return Response(status_code=303, headers={"Location": "./", **NEVER_KEEP})
    language = language_of(
        request.query_params.get("lang"), list_header(request, "accept-language"), _words()
    )
    headers = {**REVALIDATE, "Content-Language": language, "Vary": "Accept-Language"}
    return Response(_page_in(language), headers=headers, media_type="text/html; charset=utf-8")


@read_route(router, "/signin.css", include_in_schema=False)
async def style() -> Response:
    """The page's style."""
    return _file("signin.css", "text/css; charset=utf-8")


@read_route(router, "/signin.js", include_in_schema=False)
async def script() -> Response:
    """The page's script."""
    return _file("signin.js", "text/javascript; charset=utf-8")


class _Place(TypedDict):
    path: str
    secure: bool
    httponly: bool
    samesite: Literal["strict"]


def _place_of(request: Request) -> _Place:
    """Where a browser keeps the cookie, and when it sends it along."""
    return {
        "path": f"{request.scope.get('root_path', '')}/",
        "secure": request.scope["scheme"] == "https",
        "httponly": True,
        "samesite": "strict",
    }


def _session_of(request: Request) -> BrowserSession | None:
    session: BrowserSession | None = request.scope["state"].get(SESSION_KEY)
    return session


def _access_of(request: Request) -> Access:
    access: Access = request.app.state.access
    return access


def _file(name: str, media_type: str) -> Response:
    return Response(_read(name), headers=REVALIDATE, media_type=media_type)


@cache
def _words() -> dict[str, dict[str, str]]:
    words: dict[str, dict[str, str]] = orjson.loads(_read("words.json"))
    return words


@cache
def _page_in(language: str) -> str:
    words = {key: escape(text) for key, text in _words()[language].items()}
    return _read("signin.html").decode().format(lang=language, **words)


@cache
def _read(name: str) -> bytes:
    return (_FOLDER / name).read_bytes()
