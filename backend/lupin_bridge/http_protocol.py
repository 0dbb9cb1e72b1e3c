"""HTTP answers to slow readers: what waits for one is a piece, and who takes none is cut off.

uvicorn takes an answer whole and keeps what the socket does not take, for as long as the client
likes. A few hundred connections that ask for a large field and never read would fill the memory.
"""

from __future__ import annotations

import asyncio
import logging
from typing import Any, Final

from starlette.types import ASGIApp, Message, Receive, Scope, Send
from uvicorn.protocols.http.h11_impl import H11Protocol

log = logging.getLogger(__name__)

HTTP_CONNECTION_KEY: Final = "http_connection"

# What may wait for a reader; the next piece follows when the socket has taken this one.
PIECE_BYTES: Final = 256 * 1024


class HttpConnection(H11Protocol):
    """uvicorn's protocol, that also puts itself into `scope["state"]["http_connection"]`."""

    def __init__(
        self,
        config: Any,
        server_state: Any,
        app_state: dict[str, Any],
        _loop: asyncio.AbstractEventLoop | None = None,
    ) -> None:
        super().__init__(config, server_state, {**app_state, HTTP_CONNECTION_KEY: self}, _loop)

    def abort(self) -> None:
        """Tear the connection down and forget what was still to be sent."""
        self.transport.abort()


class PieceByPiece:
    """ASGI middleware: an answer returns when its reader has taken all but the last piece."""

    def __init__(self, app: ASGIApp, timeout_s: float) -> None:
        self._app = app
        self._timeout_s = timeout_s

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send the application's answers in pieces."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return

        async def send_in_pieces(message: Message) -> None:
            body = message.get("body", b"")
            if len(body) <= PIECE_BYTES:
                await send(message)
                return
            pieces = [
                {**message, "body": body[start : start + PIECE_BYTES], "more_body": True}
                for start in range(0, len(body), PIECE_BYTES)
            ]
            # uvicorn waits before it writes: the empty end waits for the last piece.
            end = {**message, "body": b""}
            try:
                for piece in (*pieces, end):
                    async with asyncio.timeout(self._timeout_s):
                        await send(piece)
            except TimeoutError:
                log.warning("cut off a reader that took nothing for %g s", self._timeout_s)
                scope["state"][HTTP_CONNECTION_KEY].abort()
                await send(end)  # returns when the connection is gone

        await self._app(scope, receive, send_in_pieces)
