"""ASGI middleware: notes every answer, sends large bodies in pieces."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Final

from starlette.types import ASGIApp, Message, Receive, Scope, Send

# Of a body, for a slow reader: the next piece follows when the socket has taken this one.
PIECE_BYTES: Final = 64 * 1024
# (path, status, seconds until the answer began)
Note = Callable[[str, int, float], None]

# Routes below /api with a class of their own.
_OWN: Final = frozenset(
    ("estimate", "export", "field", "history", "map", "signin", "state", "tags", "timeline")
)


def route_class(path: str) -> str:
    """The class of a path's route, for metrics: few, however many paths there are."""
    parts = path.strip("/").split("/")
    if parts[0] == "api" and len(parts) > 1:
        name = parts[1].partition(".")[0]
        return name if name in _OWN else "other"
    if path in ("/healthz", "/readyz", "/metrics"):
        return "health"
    return "docs" if path in ("/docs", "/openapi.json") else "page"


class Metered:
    """The outermost: notes each HTTP answer as it begins, refusals included."""

    def __init__(self, app: ASGIApp, note: Note) -> None:
        self._app = app
        self._note = note

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass on, and watch for the answer."""
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


def pieces_of(message: Message) -> Iterator[Message]:
    """A message of an answer as messages with no more than `PIECE_BYTES` of body."""
    body = message.get("body", b"")
    if len(body) <= PIECE_BYTES:
        yield message
        return
    body = memoryview(body)  # a piece is a view: of one body for a hundred readers there is one
    for start in range(0, len(body), PIECE_BYTES):
        yield {**message, "body": body[start : start + PIECE_BYTES], "more_body": True}
    # uvicorn waits before it writes: the empty end waits for the last piece.
    yield {**message, "body": b""}


class PieceByPiece:
    """An answer returns when its reader has taken all but the last piece."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send the application's answers in pieces."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return

        async def send_in_pieces(message: Message) -> None:
            for piece in pieces_of(message):
                await send(piece)

        await self._app(scope, receive, send_in_pieces)
