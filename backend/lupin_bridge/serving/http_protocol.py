"""HTTP with slow clients: what waits for one is a piece, and who takes or asks nothing is cut off.

uvicorn takes an answer whole and keeps what the socket does not take, and it waits for the rest of
a request, for as long as the client likes. A few hundred connections that ask for a large field and
never read would fill the memory, and some thousand that never finish asking use up all sockets.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Iterator
from typing import Any, Final, cast

from starlette.types import ASGIApp, Message, Receive, Scope, Send
from uvicorn.protocols.http.h11_impl import H11Protocol, RequestResponseCycle

from lupin_bridge.serving.transports import bound_unsent, tear_down

log = logging.getLogger(__name__)

HTTP_CONNECTION_KEY: Final = "http_connection"

# What may wait for a reader; the next piece follows when the socket has taken this one.
PIECE_BYTES: Final = 256 * 1024


class HttpConnection(H11Protocol):
    """uvicorn's protocol, that also puts itself into `scope["state"]["http_connection"]`.

    A client has uvicorn's `timeout_keep_alive` for a whole request, from its connection or its last
    answer on, however often it sends a byte.
    """

    def __init__(
        self,
        config: Any,
        server_state: Any,
        app_state: dict[str, Any],
        _loop: asyncio.AbstractEventLoop | None = None,
    ) -> None:
        super().__init__(config, server_state, {**app_state, HTTP_CONNECTION_KEY: self}, _loop)
        self._deadline: asyncio.TimerHandle | None = None

    def connection_made(self, transport: Any) -> None:
        """Start to wait for a request."""
        super().connection_made(transport)
        bound_unsent(transport)
        self._wait_for_request()

    def on_response_complete(self) -> None:
        """Start to wait for the next request."""
        super().on_response_complete()
        self._wait_for_request()

    def handle_websocket_upgrade(self, event: Any) -> None:
        """Hand the connection over: it is not ours any more."""
        self._stop_waiting()
        # Or this object, and all it was parsed with, would live on in the WebSocket's scope.
        del self.app_state[HTTP_CONNECTION_KEY]
        super().handle_websocket_upgrade(event)

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget the connection."""
        self._stop_waiting()
        super().connection_lost(exc)

    def abort(self) -> None:
        """Tear the connection down and forget what was still to be sent."""
        tear_down(self.transport)

    def _wait_for_request(self) -> None:
        self._stop_waiting()
        self._deadline = self.loop.call_later(self.timeout_keep_alive, self._look_for_request)

    def _stop_waiting(self) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
            self._deadline = None

    def _look_for_request(self) -> None:
        self._deadline = None
        cycle = cast("RequestResponseCycle | None", self.cycle)
        if cycle is None or cycle.response_complete:
            self.abort()


def pieces_of(message: Message) -> Iterator[Message]:
    """A message of an answer as messages with no more than `PIECE_BYTES` of body."""
    body = message.get("body", b"")
    if len(body) <= PIECE_BYTES:
        yield message
        return
    for start in range(0, len(body), PIECE_BYTES):
        yield {**message, "body": body[start : start + PIECE_BYTES], "more_body": True}
    # uvicorn waits before it writes: the empty end waits for the last piece.
    yield {**message, "body": b""}


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

        async def send_in_time(message: Message) -> None:
            # Small ones too: one behind the other, they are as much.
            try:
                async with asyncio.timeout(self._timeout_s):
                    await send(message)
            except TimeoutError:
                log.warning("cut off a reader that took nothing for %g s", self._timeout_s)
                scope["state"][HTTP_CONNECTION_KEY].abort()
                await send(message)  # returns when the connection is gone

        async def send_in_pieces(message: Message) -> None:
            for piece in pieces_of(message):
                await send_in_time(piece)

        await self._app(scope, receive, send_in_pieces)
