"""HTTP for slow clients: answers are buffered one piece at a time, and idle clients are cut off.

uvicorn buffers all of an answer that the socket does not take, and waits for the rest of a request
without limit. A few hundred connections that request a large field and never read would fill the
memory; some thousand that never finish a request would use up all sockets. The time limits are the
connection's, and so cover all that is sent: answers of routes, and refusals by access control, the
framework and this protocol alike. `AccessControl` refuses bodies that no route takes, and
`CachedResponse` sends a body in pieces.
"""

from __future__ import annotations

import asyncio
import logging
import sys
from typing import Any, Final, cast

import h11
import orjson
from uvicorn.protocols.http.h11_impl import H11Protocol, RequestResponseCycle

from lupin_bridge.serving.connections import (
    CONNECTION_KEY,
    READ_BYTES,
    SmallReads,
    bound_unsent,
    reset,
    tear_down,
)

log = logging.getLogger(__name__)

# The request's line and all header lines.
MAX_HEAD_BYTES: Final = 32 * 1024
# The parser's limit is for incomplete heads: the rest of one may come with the next read.
MAX_INCOMPLETE_BYTES: Final = MAX_HEAD_BYTES - READ_BYTES
# With more than this unsent, the next piece waits. asyncio's default, except 512 kB over TLS.
HIGH_WATER_BYTES: Final = 64 * 1024


class HttpConnection(H11Protocol, SmallReads):
    """uvicorn's protocol, with a limit on every wait.

    A client has uvicorn's `timeout_keep_alive` to send a whole request, counted from its connection
    or its last answer, however often it sends a byte. It has as long to take a piece of an answer.
    """

    def __init__(
        self,
        config: Any,
        server_state: Any,
        app_state: dict[str, Any],
        _loop: asyncio.AbstractEventLoop | None = None,
    ) -> None:
        super().__init__(config, server_state, {**app_state, CONNECTION_KEY: self}, _loop)
        self._idle_since_s = 0.0
        self._deadline: asyncio.TimerHandle

    @property
    def waiting_since_s(self) -> float | None:
        """Since when the client has requested, or taken, nothing; None: it is being served."""
        cycle = cast("RequestResponseCycle | None", self.cycle)
        is_at_work = cycle is not None and not cycle.response_complete
        is_stuck = self.flow.write_paused or self.transport.is_closing()
        return None if is_at_work and not is_stuck else self._idle_since_s

    def connection_made(self, transport: Any) -> None:
        """Start to wait for a request."""
        super().connection_made(transport)
        bound_unsent(transport)
        transport.set_write_buffer_limits(HIGH_WATER_BYTES)
        self._idle_since_s = self.loop.time()
        self._check_later()

    def data_received(self, data: bytes) -> None:
        """Take bytes; over TLS, some may come after the end."""
        if not self.transport.is_closing():
            super().data_received(data)

    def on_response_complete(self) -> None:
        """Start to wait for the next request; perhaps it has come already."""
        self._wait()
        super().on_response_complete()

    def pause_writing(self) -> None:
        """Start to wait for the client to take a piece."""
        super().pause_writing()
        self._wait()

    def handle_websocket_upgrade(self, event: Any) -> None:
        """Hand the connection over to the WebSocket protocol."""
        self._deadline.cancel()
        super().handle_websocket_upgrade(event)

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget the connection, which the timer would keep."""
        self._deadline.cancel()
        super().connection_lost(exc)

    def send_400_response(self, msg: str) -> None:
        """Refuse what the parser rejects, and close; uvicorn calls this from its `except`."""
        error = sys.exception()
        status = getattr(error, "error_status_hint", 400)
        body = orjson.dumps({"detail": str(error)[:500] or msg})
        headers = [("content-type", "application/json"), ("connection", "close")]
        for event in (
            h11.Response(status_code=status, headers=headers),
            h11.Data(data=body),
            h11.EndOfMessage(),
        ):
            self.transport.write(self.conn.send(event) or b"")
        self.transport.close()

    def abort(self) -> None:
        """Tear the connection down and forget what was still to be sent."""
        tear_down(self.transport)

    def dismiss(self, _code: int = 0, _reason: str = "") -> None:
        """Abort an answer, so that its client does not take the part for the whole.

        In HTTP/1.0, where the end of the connection ends an answer, only a reset can show that.
        """
        reset(self.transport)

    def _wait(self) -> None:
        self._idle_since_s = self.loop.time()
        self._deadline.cancel()
        self._check_later()

    def _check_later(self) -> None:
        self._deadline = self.loop.call_later(self.timeout_keep_alive, self._end_if_waiting)

    def _end_if_waiting(self) -> None:
        if self.waiting_since_s is None:
            self._check_later()
            return
        if self.flow.write_paused:
            limit_s = self.timeout_keep_alive
            log.warning("disconnected a reader that accepted nothing for %g s", limit_s)
        self.abort()
