"""Access control: checks the policy, credentials and method of every request.

The outer middleware is `AccessControl` (403, 401, 429, 413, 414, security headers), the inner one
`ReadOnly` (405).
"""

from __future__ import annotations

import asyncio
import logging
import math
import re
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final, Self

import orjson
from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import HTTPConnection
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocket
from websockets.frames import CloseCode

from lupin_bridge.access.accounts import accounts_path
from lupin_bridge.access.credentials import (
    WRITER,
    AccountError,
    Credentials,
    Person,
)
from lupin_bridge.access.people import People
from lupin_bridge.access.policy import (
    PROXY_USER_KEY,
    AccessPolicy,
    parse_host,
    parse_origin,
    path_of,
)
from lupin_bridge.serving.admission import RateLimit, client_key
from lupin_bridge.serving.connections import CONNECTION_KEY, HttpConnection
from lupin_bridge.serving.ws_protocol import Connection
from lupin_bridge.settings import SettingError, Settings

log = logging.getLogger(__name__)

_READS: Final = ("GET", "HEAD")
# Routes that begin or end a session, or write. A form, a link or a picture on a foreign page can
# send requests to them too, with the browser's cookie. But it cannot add a header: for that, a
# script needs a CORS preflight, which is refused.
SIGN_IN: Final = "/api/signin"
NOTES: Final = "/api/notes"
PUSH: Final = "/api/push"
# Takes no session, only a token in a header, which a browser never sends by itself.
OBSERVATIONS: Final = "/api/observations"
_METHODS: Final = {
    SIGN_IN: ("POST",),
    "/api/signout": ("POST",),
    NOTES: (*_READS, "POST"),
    PUSH: (*_READS, "POST"),
    OBSERVATIONS: ("POST",),
}
OWN_HEADER: Final = "X-Lupin-Twin"
# The routes that take a body, in a fleet below a site's path, and its largest size: a note of 500
# characters, all escaped, or 64 readings.
_BODIES: Final = (NOTES, OBSERVATIONS, PUSH, SIGN_IN)
MAX_BODY_BYTES: Final = 8 * 1024

# The page loads nothing from elsewhere, cannot be framed, and runs no inline script. Other pages
# can read an answer only by CORS, which CORP does not affect. No HSTS: it would block the way past
# a self-signed certificate, and it applies to all ports of a host, so to other services too.
CONTENT_POLICY: Final = (
    "default-src 'self'; img-src 'self' blob: data:; connect-src 'self'; object-src 'none'; "
    "base-uri 'none'; form-action 'self'; frame-ancestors 'none'"
)
_SECURITY_HEADERS: Final = {
    "Cache-Control": "no-cache",
    "Content-Security-Policy": CONTENT_POLICY,
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}


class ReadOnly:
    """ASGI middleware: only reads, except sign-in, notes, devices and observations."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass on the methods that a path allows, refuse all others."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return

        method, path = scope["method"], path_of(scope)
        methods = ("DELETE",) if path.startswith(f"{NOTES}/") else _METHODS.get(path, _READS)
        if method not in methods:
            detail = f"method {method[:16]} is not allowed here, use {' or '.join(methods)}"
            refusal = _refusal(405, detail, {"allow": ", ".join(methods)})
            await deny(refusal, scope, receive, send)
        elif (
            method not in _READS and path != OBSERVATIONS and OWN_HEADER not in Headers(scope=scope)
        ):
            detail = f"{method} without the header {OWN_HEADER}, expected any value"
            await deny(_refusal(403, detail), scope, receive, send)
        else:
            await self._app(scope, receive, send)


def _with_security_headers(send: Send) -> Send:
    """`send`, with the headers above on every answer that does not have its own."""

    async def send_with_headers(message: Message) -> None:
        if message["type"] in ("http.response.start", "websocket.http.response.start"):
            headers = MutableHeaders(scope=message)
            for name, value in _SECURITY_HEADERS.items():
                headers.setdefault(name, value)
        await send(message)

    return send_with_headers


# What a browser needs to sign in, and what a supervisor needs to see that the process lives.
OPEN_PATHS: Final = frozenset(
    {"/signin", "/signin.js", "/signin.css", "/font.woff2", "/lupin.svg", "/healthz"}
)
# `?lang=`, which the sign-in page goes by too.
_LANGUAGE: Final = re.compile(r"[A-Za-z]{2,3}(?:-[A-Za-z0-9]{1,8}){0,2}")

# Paths of a fleet that concern one site.
_OF_SITE: Final = re.compile(r"/(?:api/)?sites/(?P<site>[^/]*)")
# Paths for everybody who is known, whatever sites they may read.
_OF_NO_SITE: Final = frozenset({"/api/session", "/api/signout"})

# Key in a request's state: who makes it, if credentials are needed.
PERSON_KEY: Final = "person"
# How soon after the end of an account or a session its open connections end, s.
_POLL_S: Final = 2.0

# Path and query. The longest useful one has a tag_id of a few hundred bytes. Each parameter is
# parsed.
MAX_TARGET_BYTES: Final = 4_096

# Wrong tokens that an address may send at once, and per minute after that.
GUESS_BURST: Final = 10
GUESSES_PER_MINUTE: Final = 10


@dataclass(frozen=True, slots=True)
class Access:
    """Who has access: hosts, origins and people; `people` None: they were checked before.

    `site` is the site whose data this bridge has; a fleet has those of all sites.
    """

    policy: AccessPolicy = field(default_factory=AccessPolicy)
    people: People | None = None
    site: str = ""
    is_fleet: bool = False

    @property
    def is_closed(self) -> bool:
        """Whether readers need credentials."""
        return self.people is not None and self.people.is_on

    def site_of(self, path: str) -> str | None:
        """The one site that a path concerns; None: none, or several."""
        if path in _OF_NO_SITE:
            return None
        if not self.is_fleet:
            return self.site
        match = _OF_SITE.match(path)
        return None if match is None else match["site"]

    @classmethod
    def of(cls, settings: Settings, token: str | None, *, is_fleet: bool = False) -> Self:
        """From the settings, and the token if there is one.

        Raises:
            SettingError: an allowed origin or host, or the token, is invalid.

        """
        called = settings.called("token_file") if settings.token_file else "LUPIN_TOKEN"
        for name, parse in (("allow_host", parse_host), ("allow_origin", parse_origin)):
            try:
                for text in getattr(settings, name):
                    parse(text)
            except ValueError as error:
                raise SettingError(f"{settings.called(name)}: {error}") from None
        people = People(
            accounts_path(settings),
            None if token is None else Credentials(token, called),
            is_proxied=bool(settings.proxy_user_header),
        )
        if settings.accounts and not people.has_file:
            # A mistyped path would otherwise open the bridge to everybody, and say nothing.
            why = "%s: %s does not exist; until it does, nobody is asked for a name and password"
            log.warning(why, settings.called("accounts"), accounts_path(settings))
        return cls(
            AccessPolicy(settings.host, settings.allow_origin, settings.allow_host),
            people=people,
            site=settings.site,
            is_fleet=is_fleet,
        )


class AccessControl:
    """ASGI middleware: 403 for foreign hosts and pages, 401 and 429 without the token.

    Also 413 for a body that nobody reads, 414 for an address that is far too long, and security
    headers on every answer.
    """

    def __init__(self, app: ASGIApp, access: Access) -> None:
        self._app = app
        self._access = access
        self._guesses = RateLimit(GUESSES_PER_MINUTE / 60.0, GUESS_BURST)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or refuse it."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        send = _with_security_headers(send)
        request = HTTPConnection(scope)
        if (too_large := _too_large(request)) is not None:
            await deny(too_large, scope, receive, send)
            return
        scheme = "https" if scope["scheme"] in ("https", "wss") else "http"
        decision = self._access.policy.judge(
            scheme, request.headers, wants_page=_wants_page(request)
        )
        if self._access.policy.origins:
            send = _with_cors(send, decision.foreign)
        if decision.refusal is not None:
            refusal = _refusal(403, decision.refusal)
        elif decision.foreign is not None and _is_preflight(request):
            refusal = _refusal(204, "", _PREFLIGHT_HEADERS)
        elif decision.foreign is not None and scope.get("method", "GET") not in _READS:
            refusal = _refusal(403, "pages of another origin may only read here")
        else:
            try:
                checked = self._check_credentials(request)
                if isinstance(checked, Person):
                    checked = self._check_reach(checked, path_of(scope))
                if not isinstance(checked, Response):
                    await self._pass_on(checked, scope, receive, send)
                    return
            except AccountError as error:
                # Of a route too. It names the file, and whoever signs in is not known yet.
                log.warning("%s: a request is refused", error)
                why = "the accounts cannot be used: is the disk full? The bridge's log says more"
                checked = _refusal(503, why, {"retry-after": "5"})
            refusal = checked
        await deny(refusal, scope, receive, send)

    def _check_reach(self, person: Person, path: str) -> Response | Person:
        """The person, or a refusal if they may not use this path."""
        if person.role == WRITER and path != OBSERVATIONS:
            detail = f"{person.name} is a writer: it may only post to {OBSERVATIONS}"
            return _refusal(403, detail)
        site = self._access.site_of(path)
        if site is not None and not person.reads(site):
            here = f"this is the site {site[:64]!r}" if site else "this bridge has no --site"
            return _refusal(403, f"{person.name} is for {', '.join(person.sites)}: {here}")
        return person

    async def _pass_on(
        self, person: Person | None, scope: Scope, receive: Receive, send: Send
    ) -> None:
        # Or FastAPI would parse the cookies of every request, wanted or not.
        scope = {**scope, "headers": [line for line in scope["headers"] if line[0] != b"cookie"]}
        if person is not None:
            scope["state"] = {**scope.get("state", {}), PERSON_KEY: person}
        people = self._access.people
        # What needs no credentials has no session to end with: a sign-in may take seconds.
        if people is None or (person is None and people.is_on):
            await self._app(scope, receive, send)
            return
        looking = asyncio.create_task(_end_with(people, person, scope))
        try:
            await self._app(scope, receive, send)
        finally:
            looking.cancel()

    def _check_credentials(self, request: HTTPConnection) -> Response | Person | None:
        """Who makes the request; None: no credentials are needed here; or a refusal."""
        path, people = path_of(request.scope), self._access.people
        if people is None or path in OPEN_PATHS or not people.is_on:
            return None
        named = request.scope.get("state", {}).get(PROXY_USER_KEY)
        header = request.headers.get("authorization")
        if named is not None:
            return people.by_proxy(named) or _unauthorized("the proxy sent no valid user name")
        if header is not None:
            return self._check_header(people, header, client_of(request))
        if path == SIGN_IN:
            return None  # the route checks name and password, if there are accounts
        # A wrong cookie does not count as a guess: nobody can forge one without the token.
        return people.by_cookies(request.scope["headers"]) or _sign_in_first(request)

    def _check_header(self, people: People, header: str, client: str) -> Response | Person:
        now_s = time.monotonic()
        wait_s = self._guesses.wait_s(client, now_s)
        if wait_s > 0.0:
            return _refusal(
                429,
                f"{client} has sent more than {GUESS_BURST} wrong tokens and {GUESSES_PER_MINUTE} "
                "a minute: no token is checked until Retry-After",
                {"retry-after": str(math.ceil(wait_s))},
            )
        scheme, _, token = header.partition(" ")
        person = people.by_token(token.strip()) if scheme.lower() == "bearer" else None
        if person is not None:
            return person
        self._guesses.take(client, now_s)
        log.warning("wrong token from %s", client)
        return _unauthorized("this is not the bridge's token, expected Authorization: Bearer")


def _too_large(request: HTTPConnection) -> Response | None:
    """The refusal of an address that is far too long, or of a body that no route reads.

    RFC 9112, section 6: only two headers announce a body. h11 has checked the length.
    """
    scope, headers = request.scope, request.headers
    size = len(scope.get("raw_path") or b"") + len(scope["query_string"])
    if size > MAX_TARGET_BYTES:
        return _refusal(414, f"the address has {size} bytes, the limit is {MAX_TARGET_BYTES}")
    is_wanted = scope.get("method") == "POST" and path_of(scope).endswith(_BODIES)
    most = MAX_BODY_BYTES if is_wanted else 0
    length, coding = headers.get("content-length", "0"), headers.get("transfer-encoding")
    if coding is None and int(length) <= most:
        return None
    given = f"content-length: {length}" if coding is None else f"transfer-encoding: {coding[:32]}"
    limit = f"the limit is {most} bytes" if most else "and none is read here"
    # uvicorn would parse all of it: only a connection that is closed reads nothing.
    closing = {"connection": "close"}
    return _refusal(413, f"the request has a body ({given}), {limit}", closing)


def client_of(request: HTTPConnection) -> str:
    """The client that limits count for: the peer, or the one that a trusted proxy names."""
    return client_key(request.client.host if request.client is not None else "")


def _refusal(status: int, detail: str, headers: Mapping[str, str] | None = None) -> Response:
    """A refusal, sent instead of the application's answer to a request or WebSocket handshake."""
    body = orjson.dumps({"detail": detail}) if detail else b""
    known = {"cache-control": "no-store", **(headers or {})}
    return Response(body, status, known, "application/json" if body else None)


async def deny(response: Response, scope: Scope, receive: Receive, send: Send) -> None:
    """Send a response instead of the application's."""
    if scope["type"] == "websocket":
        await WebSocket(scope, receive, send).send_denial_response(response)
    else:
        await response(scope, receive, send)


_PREFLIGHT_HEADERS: Final = {
    "access-control-allow-methods": "GET, HEAD",
    "access-control-allow-headers": "Authorization, If-None-Match",
    "access-control-max-age": "600",
}


def _unauthorized(detail: str) -> Response:
    return _refusal(401, detail, {"www-authenticate": 'Bearer realm="lupin-twin"'})


def _sign_in_first(request: HTTPConnection) -> Response:
    if _wants_page(request):
        # Relative, for a bridge behind a path prefix.
        location = "../" * (path_of(request.scope).count("/") - 1) + "signin"
        language = request.query_params.get("lang", "")
        if _LANGUAGE.fullmatch(language):
            location += f"?lang={language}"
        return _refusal(303, "sign in first", {"location": location})
    return _unauthorized(
        "a token is needed: send it as Authorization: Bearer, or sign in at /signin"
    )


def _is_preflight(request: HTTPConnection) -> bool:
    return (
        request.scope.get("method") == "OPTIONS"
        and "access-control-request-method" in request.headers
    )


def _wants_page(request: HTTPConnection) -> bool:
    path = path_of(request.scope)
    return (
        request.scope.get("method") in ("GET", "HEAD")
        and (path.endswith(".html") or not path.startswith("/api/"))
        and "text/html" in request.headers.get("accept", "")
    )


def _with_cors(send: Send, foreign: str | None) -> Send:
    """Let the pages of an allowed origin read the answer, and keep caches from mixing them up."""

    async def send_with_cors(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            headers.add_vary_header("Origin")
            if foreign is not None:
                headers["Access-Control-Allow-Origin"] = foreign
                # The operator has listed this origin, and never as a pattern. So its pages may use
                # the session, which the browser sends for a WebSocket anyway.
                headers["Access-Control-Allow-Credentials"] = "true"
                own = [name for name in headers if name.startswith("x-field-")]
                headers["Access-Control-Expose-Headers"] = ", ".join(("ETag", "Retry-After", *own))
        await send(message)

    return send_with_cors


async def _end_with(people: People, person: Person | None, scope: Scope) -> None:
    """End the connection when its session ends; without a person, when accounts are created."""
    try:
        await asyncio.sleep(_POLL_S)
        while people.may_stay(person):
            await asyncio.sleep(_POLL_S)
    except AccountError as error:
        log.warning("%s: an open connection is closed", error)
    connection: HttpConnection | Connection = scope["state"][CONNECTION_KEY]
    connection.dismiss(CloseCode.POLICY_VIOLATION, "the session has ended: sign in again")
