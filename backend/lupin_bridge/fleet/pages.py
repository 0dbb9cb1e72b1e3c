"""The pages of sites: made when opened, closed when nobody reads them or others need the slot.

A site's page gets a link back to the overview: the HMI itself knows of only one greenhouse.
"""

from __future__ import annotations

import asyncio
import time
from collections import Counter
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, field
from hashlib import blake2b
from html import escape
from pathlib import Path
from typing import Final
from urllib.parse import parse_qs

from fastapi import Request, Response
from starlette.requests import HTTPConnection
from starlette.types import ASGIApp, Receive, Scope, Send

from lupin_bridge.access.middleware import client_of, deny
from lupin_bridge.bridge import Bridge
from lupin_bridge.routes.answers import error_response, has_etag, not_modified
from lupin_bridge.serving.admission import REVALIDATE

_STYLE: Final = '<link rel="stylesheet" href="./fleet-back.css" /></head>'
# `fleet-back.css` shows the one in the page's language.
_WORDS: Final = "".join(
    f'<span lang="{language}">{words}</span>'
    for language, words in {
        "en": "All greenhouses",
        "de": "Alle Gewächshäuser",
        "nl": "Alle kassen",
        "es": "Todos los invernaderos",
    }.items()
)
_ROOT: Final = '<div id="root">'


class SitePage:
    """The HMI's page, `index.html` of the folder, with a link back; there may be none."""

    def __init__(self, static_folder: Path) -> None:
        file = static_folder / "index.html"
        self._text = file.read_text(encoding="utf-8") if file.is_file() else ""

    def answer(self, request: Request) -> Response | None:
        """The page, whose link back keeps the query; None: it is served unchanged, or missing."""
        query = request.url.query
        if not self._text or "kiosk" in parse_qs(query, keep_blank_values=True):
            return None
        to = escape(f"../../?{query}" if query else "../../")
        link = f'<nav class="fleet-back"><a href="{to}">‹ {_WORDS}</a></nav>{_ROOT}'
        body = self._text.replace("</head>", _STYLE, 1).replace(_ROOT, link, 1).encode()
        etag = f'"{blake2b(body, digest_size=12).hexdigest()}"'
        if has_etag(request, etag):
            return not_modified(etag)
        return Response(body, 200, {"ETag": etag, **REVALIDATE}, "text/html; charset=utf-8")


# A page without requests or followers for this long is closed.
_IDLE_S: Final = 120.0
_PREFIX: Final = "/sites/"


@dataclass(slots=True, eq=False)
class Opened:
    """A site's page: its bridge and its application, as if it were the only one."""

    bridge: Bridge
    app: ASGIApp
    ready: asyncio.Task[None]
    used_s: float = field(default_factory=time.monotonic)
    users: Counter[str] = field(default_factory=Counter)


class SitePages:
    """At most `limit` open pages. `make` makes one; `sites` returns the sites that exist."""

    def __init__(
        self, make: Callable[[str], Opened], sites: Callable[[], Collection[str]], limit: int
    ) -> None:
        self.sites = sites
        self._make, self._limit = make, limit
        # In the order in which they were opened.
        self._open: dict[str, Opened] = {}
        self._closing: set[asyncio.Task[None]] = set()

    def __len__(self) -> int:
        return len(self._open)

    def __iter__(self) -> Iterator[Opened]:
        return iter(self._open.values())

    def page_of(self, name: str, client: str) -> Opened | str:
        """The site's page for a client, made if need be; or why there is none."""
        opened = self._open.get(name)
        if opened is None:
            if name not in self.sites():
                known = len(self.sites())
                return f"there is no site {name[:64]!r} in the archive, which has {known}"
            if len(self._open) >= self._limit:
                least = self._least_needed(client)
                if least is None:
                    return f"{self._limit} sites are open here, the limit: try again later"
                self._close(least)
            opened = self._open[name] = self._make(name)
        return opened

    def _least_needed(self, client: str) -> str | None:
        """The site to close for one of a client's; None: there is none.

        It is one that nobody reads. If all are read, the client that reads the most loses the
        newest that it alone reads. It does so only to a client that reads at least two fewer.
        """
        idle = [it for it in self._open.items() if not it[1].users]
        if idle:
            return min(idle, key=lambda it: it[1].used_s)[0]
        read = Counter(user for opened in self._open.values() for user in opened.users)
        ((largest, count),) = read.most_common(1)
        own = [name for name, it in self._open.items() if it.users.keys() == {largest}]
        return own[-1] if own and count >= read[client] + 2 else None

    def _close(self, name: str) -> None:
        opened = self._open.pop(name)
        opened.bridge.announce_shutdown()
        opened.bridge.hub.evict_all(f"{self._limit} sites are open here, the limit")

        async def end() -> None:
            await asyncio.wait((opened.ready,))
            await opened.bridge.stop()

        closing = asyncio.create_task(end(), name=f"close {name}")
        self._closing.add(closing)
        closing.add_done_callback(self._closing.discard)

    def tidy(self, now_s: float) -> None:
        """Close the pages that nobody reads any more."""
        for name, opened in list(self._open.items()):
            if not opened.users and now_s - opened.used_s >= _IDLE_S:
                self._close(name)

    async def close(self) -> None:
        """Close them all."""
        for name in list(self._open):
            self._close(name)
        await asyncio.gather(*self._closing)


class Sites:
    """ASGI middleware: passes what is below `/sites/NAME` to that site's application."""

    def __init__(self, app: ASGIApp, pages: SitePages, page: SitePage) -> None:
        self._app = app
        self._pages = pages
        self._page = page

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on to its site, or to the overview."""
        root = scope.get("root_path", "")
        path = scope.get("path", "")[len(root) :]
        if scope["type"] not in ("http", "websocket") or not path.startswith(_PREFIX):
            await self._app(scope, receive, send)
            return
        name, slash, rest = path[len(_PREFIX) :].partition("/")
        client = client_of(HTTPConnection(scope))
        found = self._pages.page_of(name, client)
        if isinstance(found, str):
            status = 503 if name in self._pages.sites() else 404
            await deny(error_response(found, status), scope, receive, send)
            return
        if not slash:
            # Relative, as all links are: below whatever prefix this is.
            await Response(status_code=307, headers={"location": f"{name}/"})(scope, receive, send)
            return
        found.users[client] += 1
        try:
            await asyncio.shield(found.ready)
            own = {**scope, "root_path": f"{root}{_PREFIX}{name}"}
            own.pop("app_root_path", None)
            is_page = not rest and scope.get("method") in ("GET", "HEAD")
            page = self._page.answer(Request(scope)) if is_page else None
            await (page or found.app)(own, receive, send)
        finally:
            found.users[client] -= 1
            found.users += Counter()  # drops clients that read no more
            found.used_s = time.monotonic()
