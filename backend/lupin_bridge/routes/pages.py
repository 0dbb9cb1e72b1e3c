"""The bridge's own pages: sign-in, `/openapi.json`, the guide, and `/` without the HMI."""

from __future__ import annotations

import time
from collections.abc import Collection
from functools import cache, partial
from html import escape
from pathlib import Path
from typing import Final

import orjson
from fastapi import APIRouter, FastAPI, Request, Response
from starlette.responses import FileResponse, RedirectResponse
from starlette.staticfiles import StaticFiles
from starlette.types import Scope

from lupin_bridge.access.credentials import SHARED
from lupin_bridge.access.middleware import CONTENT_POLICY, Access, client_of
from lupin_bridge.feed.source import TwinSource
from lupin_bridge.field import listed
from lupin_bridge.routes.answers import (
    NEVER_STORE,
    ApiRoute,
    computed,
    error_response,
    json_response,
    list_header,
    person_of,
    read_route,
    respond,
    while_client_waits,
)
from lupin_bridge.serving.admission import REVALIDATE, Answer
from lupin_bridge.stream import routes_schema

router = APIRouter(route_class=ApiRoute)
# In the application only where the page was not built.
no_page_router = APIRouter()

# Rough time to write either document, s.
_WRITE_S: Final = 0.02

GUIDE_PATH: Final = "/docs/guide"
_NO_GUIDE: Final = (
    "the guide was not built: run `make docs` in the clone, or install a release; "
    "/openapi.json has all routes"
)
# The guide's theme has inline styles; scripts are files, as everywhere.
_GUIDE_POLICY: Final = f"{CONTENT_POLICY}; style-src 'self' 'unsafe-inline'"

HOW_TO_BUILD: Final = (
    "build it with `npm ci && npm run build` in the project's folder, install the bridge again "
    "(`pip install .`) unless it is installed with -e, and restart it"
)


@read_route(router, "/openapi.json", include_in_schema=False)
async def openapi(request: Request) -> Response:
    """The OpenAPI document."""
    app, prefix = request.app, request.scope.get("root_path", "")
    key = f"openapi {prefix}"

    def write(_: object) -> Answer:
        document = app.openapi()
        if prefix:
            document = {**document, "servers": [{"url": prefix}]}
        body = orjson.dumps(document, option=orjson.OPT_INDENT_2)
        return Answer(body, "application/json", REVALIDATE)

    if app.state.bridge is None:
        return json_response(write(None).body, headers=REVALIDATE)
    compute = partial(computed, app.state.bridge, client_of(request), key, write, _WRITE_S)
    return await respond(request, key, compute)


# --- the guide -----------------------------------------------------------------------------------


class _Guide(StaticFiles):
    async def get_response(self, path: str, scope: Scope) -> Response:
        response = await super().get_response(path, scope)
        response.headers["Content-Security-Policy"] = _GUIDE_POLICY
        return response


@read_route(router, "/docs", include_in_schema=False)
async def docs(request: Request) -> Response:
    """The routes, in the guide."""
    return _to_guide(request, "reference/http.html")


@read_route(router, GUIDE_PATH, include_in_schema=False)
async def to_guide(request: Request) -> Response:
    """The documentation, as HTML."""
    return _to_guide(request)


def _to_guide(request: Request, page: str = "") -> Response:
    return RedirectResponse(f"{request.scope.get('root_path', '')}{GUIDE_PATH}/{page}")


async def _no_guide(_request: Request) -> Response:
    return error_response(_NO_GUIDE, 404)


def add_guide(app: FastAPI, folder: Path) -> None:
    """Serve the built guide, or say how to build it."""
    if (folder / "index.html").is_file():
        app.mount(GUIDE_PATH, _Guide(directory=folder, html=True), name="guide")
    else:
        app.add_route(f"{GUIDE_PATH}/{{path:path}}", _no_guide, include_in_schema=False)


@read_route(no_page_router, "/", include_in_schema=False)
async def no_page() -> Response:
    """503, with how to build the page."""
    text = f"The page was not built: {HOW_TO_BUILD}. The data is there, see /docs."
    return Response(text, 503, NEVER_STORE, "text/plain; charset=utf-8")


def language_of(request: Request, known: Collection[str]) -> str:
    """One of `known`: what `?lang=` asks for, else the first in `Accept-Language`, else English.

    As in the HMI, "de-AT" and "DE" are German, and an unknown language is English.
    """
    wanted = request.query_params.get("lang")
    if wanted is not None:
        return _known_language(wanted, known) or "en"
    accepted = listed(list_header(request, "accept-language"))
    return next(filter(None, (_known_language(tag, known) for tag in accepted)), "en")


def _known_language(tag: str, known: Collection[str]) -> str | None:
    name = tag.strip().partition("-")[0].lower()
    return name if name in known else None


# Not in the HMI's folder: its build empties that, and sign-in comes before the HMI may be read.
_SIGNIN_FOLDER: Final = Path(__file__).parent / "signin_page"
ASSETS: Final = Path(__file__).parents[1] / "static" / "assets"


@router.post("/api/signin", include_in_schema=False)
async def sign_in(request: Request, given: routes_schema.SignIn | None = None) -> Response:
    """Exchange a token, which `AccessControl` has checked, or a password for a session cookie.

    Only the sign-in page uses this: programs send `Authorization: Bearer` with every request.
    """
    people, person = _access_of(request).people, person_of(request)
    if people is None or not people.is_on:
        return error_response("this bridge needs no token: there is nothing to sign in to", 404)
    address = client_of(request)
    if "authorization" not in request.headers:
        if not people.has_file:  # a session must not renew itself
            return error_response(
                "send the token as Authorization: Bearer", 401, {"WWW-Authenticate": "Bearer"}
            )
        if given is None:
            return error_response("the body is empty, expected a name and a password", 400)
        person = await while_client_waits(
            request, people.check(given.name, given.password, address)
        )
    begun = None
    if person is not None:
        begun = await while_client_waits(request, people.sign_in(person, address))
    if begun is None:
        return error_response("there is no such account, or the password is wrong", 401)
    name, cookie, lasts_s = begun
    response = Response(status_code=204, headers=NEVER_STORE)
    _set_cookie(request, response, name, cookie, lasts_s)
    return response


@router.post("/api/signout", include_in_schema=False)
async def sign_out(request: Request) -> Response:
    """End the session of the request, and all its open connections."""
    people, person = _access_of(request).people, person_of(request)
    if people is None or person is None:
        return error_response("this bridge needs no token: there is nothing to sign out of", 404)
    response = Response(status_code=204, headers=NEVER_STORE)
    if person.session:
        name = await people.sign_out(person, client_of(request))
        _set_cookie(request, response, name, "", 0)
    return response


@read_route(
    router,
    "/api/session",
    summary="Who makes the request, and can the session be signed out of?",
    responses={200: {"model": routes_schema.Session}},
)
async def session_route(request: Request) -> Response:
    """Who makes the request, and how long its session still lasts, if there is one."""
    person = person_of(request) or SHARED
    # A fleet has no log of its own.
    source: TwinSource | None = getattr(request.app.state.bridge, "source", None)
    is_writer = source is not None and source.writes_notes
    seconds_left = max(0.0, person.ends_at_s - time.time()) if person.session else None
    body = {
        "can_sign_out": bool(person.session),
        "seconds_left": seconds_left,
        "name": person.name or None,
        "role": person.role,
        "can_write_notes": is_writer and person.may("operator"),
    }
    return json_response(orjson.dumps(body))


@read_route(router, "/signin", include_in_schema=False)
async def page(request: Request) -> Response:
    """The sign-in page; a redirect to the HMI if nobody needs to sign in."""
    access = _access_of(request)
    if not access.is_closed:
        return Response(status_code=303, headers={"Location": "./", **NEVER_STORE})
    language = language_of(request, _words())
    headers = {**REVALIDATE, "Content-Language": language, "Vary": "Accept-Language"}
    has_accounts = access.people is not None and access.people.has_file
    page = _page_in(language, has_accounts=has_accounts)
    return Response(page, headers=headers, media_type="text/html; charset=utf-8")


def _add_file(name: str, media_type: str) -> None:
    @read_route(router, f"/{name}", include_in_schema=False)
    async def of_page() -> Response:
        return Response(_read_file(name), headers=REVALIDATE, media_type=media_type)


_add_file("signin.css", "text/css; charset=utf-8")
_add_file("signin.js", "text/javascript; charset=utf-8")


@read_route(router, "/font.woff2", include_in_schema=False)
async def font() -> Response:
    """The HMI's font, under a fixed name for the report and the sign-in page."""
    found = next(ASSETS.glob("inter-*.woff2"), None)
    if found is None:
        return error_response("the page was not built, and has no font", 404)
    return FileResponse(found, headers={"Cache-Control": "max-age=604800"}, media_type="font/woff2")


def _set_cookie(request: Request, response: Response, name: str, value: str, lasts_s: int) -> None:
    """Set the session cookie for `lasts_s`; 0 deletes it."""
    response.set_cookie(
        name,
        value,
        max_age=lasts_s,
        path=f"{request.scope.get('root_path', '')}/",
        secure=request.scope["scheme"] == "https",
        httponly=True,
        samesite="strict",
    )


def _access_of(request: Request) -> Access:
    access: Access = request.app.state.access
    return access


@cache
def _words() -> dict[str, dict[str, str]]:
    words: dict[str, dict[str, str]] = orjson.loads(_read_file("words.json"))
    return words


@cache
def _page_in(language: str, *, has_accounts: bool) -> str:
    words = {key: escape(text) for key, text in _words()[language].items()}
    if has_accounts:
        words |= {"token": words["password"], "wrong": words["wrong_person"]}
    page = _read_file("signin.html").decode()
    return page.format(lang=language, hidden="" if has_accounts else "hidden", **words)


@cache
def _read_file(name: str) -> bytes:
    return (_SIGNIN_FOLDER / name).read_bytes()
