"""The WebSocket connection as the fan-out needs it: write at once, or know that it cannot take it.

uvicorn hands an application `send()` alone, which waits for a slow client. The fan-out must not
wait: it asks, and keeps the newest frame for the moment at which the client is ready again.
"""

from __future__ import annotations

import asyncio
import socket
import struct
from collections.abc import Callable
from typing import Any

from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

CONNECTION_KEY = "connection"

# What the kernel may hold of a frame before the network takes it: what is under way does not count.
UNSENT_BYTES = 128 * 1024

# How long a client that is told to go has to read the reason before its socket is torn down.
CLOSE_GRACE_S = 1.0


class Connection(WebSocketsSansIOProtocol):
    """uvicorn's protocol, that also puts itself into `scope["state"]["connection"]`."""

    def __init__(
        self,
        config: Any,
        server_state: Any,
        app_state: dict[str, Any],
        _loop: asyncio.AbstractEventLoop | None = None,
    ) -> None:
        super().__init__(config, server_state, {**app_state, CONNECTION_KEY: self}, _loop)
        self.on_writable: Callable[[], None] | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Stop at the first bytes that the socket does not take: what is queued is one frame.

        Over TLS, asyncio keeps another 64 kB below the limit that can be set.
        """
        super().connection_made(transport)
        # The kernel would take 4 MB more (tcp_wmem): for a slow reader, minutes of old states.
        self.transport.get_extra_info("socket").setsockopt(
            socket.IPPROTO_TCP, socket.TCP_NOTSENT_LOWAT, UNSENT_BYTES
        )
        # Not 0: asyncio's TLS transport stops at the limit, not past it, and would stop on nothing.
        self.transport.set_write_buffer_limits(high=1, low=0)

    def resume_writing(self) -> None:
        """The socket has taken everything: time for the newest frame."""
        super().resume_writing()
        if self.on_writable is not None:
            self.on_writable()

    async def send(self, message: Any) -> None:
        """Pass on; a handshake that was answered with a refusal counts as complete.

        uvicorn would take it for one that the application forgot, and log an error for each.
        """
        await super().send(message)
        if message["type"] == "websocket.http.response.body" and self.close_sent:
            self.handshake_complete = True

    def handle_ping(self) -> None:
        """Answer a ping, unless its sender does not read: unread answers would only pile up."""
        pong = b"".join(self.conn.data_to_send())
        if self.writable.is_set():
            self.transport.write(pong)

    @property
    def can_take(self) -> bool:
        """Whether everything written so far has gone out, and more may follow."""
        return self.writable.is_set() and not self.close_sent and not self.transport.is_closing()

    def write(self, wire: bytes) -> None:
        """Write a whole frame; never waits. The caller has asked `can_take`."""
        self.transport.write(wire)

    async def write_when_free(self, wire: bytes) -> None:
        """Write as soon as all before has gone out; at most one frame slips in between.

        Nothing is written to a connection that is closing.
        """
        await self.writable.wait()
        if not self.close_sent and not self.transport.is_closing():
            self.transport.write(wire)

    def dismiss(self, code: int, reason: str) -> None:
        """Send a close frame with the reason, and tear the socket down if nobody reads it."""
        if not self.close_sent and not self.transport.is_closing():
            self.conn.send_close(code, reason)
            self.transport.write(b"".join(self.conn.data_to_send()))
            self.close_sent = True
        self.loop.call_later(CLOSE_GRACE_S, self._tear_down)

    def _tear_down(self) -> None:
        if self.transport.get_write_buffer_size() > 0:
            # A reset: or the kernel would go on offering what nobody reads for four minutes more.
            self.transport.get_extra_info("socket").setsockopt(
                socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0)
            )
        self.transport.abort()
