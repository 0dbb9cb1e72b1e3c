"""What becomes of HTTP requests: status and time of every answer, refusals at the door included."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Final

from starlette.types import ASGIApp, Message, Receive, Scope, Send

# (path, status, seconds until the answer began)
Note = Callable[[str, int, float], None]

# What has a kind of its own below /api.
_OWN: Final = frozenset(
    ("estimate", "export", "field", "history", "map", "signin", "state", "tags", "timeline")
)


def route_class(path: str) -> str:
    """Which kind of route a path is of: few, however many paths are asked for."""
    parts = path.strip("/").split("/")
    if parts[0] == "api" and len(parts) > 1:
        name = parts[1].partition(".")[0]
        return name if name in _OWN else "other"
    if path in ("/healthz", "/readyz", "/metrics"):
        return "health"
    return "docs" if path in ("/docs", "/openapi.json") else "page"


class Metered:
    """ASGI middleware, the outermost: notes each HTTP answer as it begins."""

    def __init__(self, app: ASGIApp, note: Note) -> None:
        self._app = app
        self._note = note

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass on, and listen to the answer."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        began_s = time.monotonic()
        path: str = scope["path"]

        async def send_and_note(message: Message) -> None:
            if message["type"] == "http.response.start":
                self._note(path, message["status"], time.monotonic() - began_s)
            await send(message)

        await self._app(scope, receive, send_and_note)
