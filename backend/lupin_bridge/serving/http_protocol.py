"""HTTP for slow clients: answers are buffered one piece at a time, and idle clients are cut off.

uvicorn buffers all of an answer that the socket does not take, and waits for the rest of a request
without limit. A few hundred connections that request a large field and never read would fill the
memory; some thousand that never finish a request would use up all sockets. The time limits are the
connection's, and so cover all that is sent: answers of routes, and refusals by access control, the
framework and this protocol alike.

The parser gets one whole head at a time, of bounded size and number of lines. Only a few routes
take a body, of bounded size and declared length; a request with any other body is refused before
the body is read.
"""

from __future__ import annotations

import asyncio
import logging
import re
import sys
from collections.abc import Iterator
from contextlib import suppress
from typing import Any, Final, cast

import h11
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from uvicorn.protocols.http.h11_impl import H11Protocol, RequestResponseCycle

from lupin_bridge.serving.admission import client_key
from lupin_bridge.serving.connections import (
    CLOSE_GRACE_S,
    CONNECTION_KEY,
    bound_unsent,
    refusal,
    reset,
    tear_down,
)

log = logging.getLogger(__name__)

# The request's line and all header lines. The parser's own limit is only for incomplete heads: it
# would take one that comes at once, up to asyncio's 256 kB.
MAX_HEAD_BYTES: Final = 32 * 1024
# As many as the parser of WebSocket handshakes takes. The cost of a head depends on its lines:
# 8,000 tiny ones take 23 ms to parse. A continued line (RFC 9112, section 5.2) counts as two.
MAX_HEADERS: Final = 128
MAX_LINES: Final = 1 + MAX_HEADERS + 1  # the request's line, and the blank one
# With more than this unsent, the next piece waits. asyncio's default, except 512 kB over TLS.
HIGH_WATER_BYTES: Final = 64 * 1024
# The routes that take a body, and its largest size: a note of 500 characters, all escaped, or 64
# readings.
BODIES: Final = (b"/api/notes", b"/api/observations", b"/api/push", b"/api/signin")
MAX_BODY_BYTES: Final = 8 * 1024

# h11's own: where a head ends.
_BLANK_LINE: Final = re.compile(rb"\n\r?\n")


class _Requests(h11.Connection):
    """h11's parser, which takes only a path as target, and a small body, if any.

    `left` is how much of the body is still to come, bytes.
    """

    left = 0

    def next_event(self) -> Any:
        """As h11; a request that is not served here is refused like invalid HTTP."""
        event = super().next_event()
        if isinstance(event, h11.Request):
            # RFC 9112, section 3.2.2, demands that absolute URLs are taken too. Only a client that
            # takes us for its proxy sends one, and then there are two names of the host.
            if not event.target.startswith(b"/"):
                raise h11.RemoteProtocolError(
                    f"the request's target is {event.target[:128].decode('latin-1')!r}, expected a "
                    "path that begins with /"
                )
            wants = event.method == b"POST" and event.target.partition(b"?")[0].endswith(BODIES)
            self.left = _body_of(event, MAX_BODY_BYTES if wants else 0)
        return event


def _body_of(event: h11.Request, most: int) -> int:
    """The length of the body, bytes; h11 has checked that there is one length, of few digits.

    RFC 9112, section 6: only these two headers announce a body.
    """
    length = 0
    for name, value in event.headers:
        if name == b"content-length":
            length = int(value)
        if name == b"transfer-encoding" or length > most:
            limit = f"the limit is {most} bytes" if most else "and none is read here"
            given = f"{name.decode()}: {value[:32].decode('latin-1')}"
            raise h11.RemoteProtocolError(
                f"the request has a body ({given}), {limit}",
                error_status_hint=413,
            )
    return length


class HttpConnection(H11Protocol):
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
        self.conn: _Requests = _Requests(h11.SERVER)
        self.address = ""
        self._deadline: asyncio.TimerHandle | None = None
        self._reader_deadline: asyncio.TimerHandle | None = None
        self._is_refused = False
        self._is_handed_over = False
        self._idle_since_s = 0.0
        # Received, and not passed to the parser yet.
        self._unparsed = bytearray()

    @property
    def waiting_since_s(self) -> float | None:
        """Since when the client has requested, or taken, nothing; None: it is being served."""
        if self.transport.is_closing() or (self._is_at_work and self._reader_deadline is None):
            return None
        return self._idle_since_s

    def connection_made(self, transport: Any) -> None:
        """Start to wait for a request."""
        super().connection_made(transport)
        if self.client is not None:
            self.address = client_key(self.client[0])
        bound_unsent(transport)
        transport.set_write_buffer_limits(HIGH_WATER_BYTES)
        self._wait_for_request()

    def data_received(self, data: bytes) -> None:
        """Take bytes, unless the client was refused."""
        if self._is_refused:
            self.flow.pause_reading()  # input is not read any more, but an end is noticed
        else:
            self._unparsed += data
            self._parse()

    def on_response_complete(self) -> None:
        """Go on to the next request, and start to wait for it."""
        super().on_response_complete()
        self._parse()
        if not self._is_handed_over:
            self._wait_for_request()

    def pause_writing(self) -> None:
        """Start to wait for the client to take a piece."""
        super().pause_writing()
        self._idle_since_s = self.loop.time()
        self._reader_deadline = self.loop.call_later(self.timeout_keep_alive, self._give_up)

    def resume_writing(self) -> None:
        """Stop waiting: the client has taken the piece."""
        super().resume_writing()
        if self._reader_deadline is not None:
            self._reader_deadline.cancel()
            self._reader_deadline = None

    def handle_websocket_upgrade(self, event: Any) -> None:
        """Hand the connection over to the WebSocket protocol."""
        self._is_handed_over = True
        self._stop_waiting()
        super().handle_websocket_upgrade(event)

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget the connection."""
        self._stop_waiting()
        super().connection_lost(exc)

    def send_400_response(self, msg: str) -> None:
        """Refuse what the parser rejects, and close; uvicorn calls this from its `except`."""
        error = sys.exception()
        if isinstance(error, h11.RemoteProtocolError):
            self._refuse(error.error_status_hint, str(error)[:500])
        else:
            self._refuse(400, msg)

    def shutdown(self) -> None:
        """Close once the answer is sent; a refusal, unknown to h11, closes by itself."""
        if not self._is_refused:
            super().shutdown()

    def abort(self) -> None:
        """Tear the connection down and forget what was still to be sent."""
        tear_down(self.transport)

    def dismiss(self, _code: int = 0, _reason: str = "") -> None:
        """Abort an answer, so that its client does not take the part for the whole.

        In HTTP/1.0, where the end of the connection ends an answer, only a reset can show that.
        """
        reset(self.transport)

    def end_waiting(self) -> None:
        """Refuse a request that waits for its answer; an answer that has begun goes on."""
        cycle = cast("RequestResponseCycle | None", self.cycle)
        if cycle is not None and not cycle.response_started:
            # For the application, its client has left: it cancels its work.
            cycle.disconnected = True
            cycle.message_event.set()
            # A restart takes about this long.
            self._refuse(503, "the bridge is shutting down", "Retry-After: 3")

    def _should_upgrade(self) -> bool:
        # RFC 9110, section 7.8: an upgrade in HTTP/1.0 is to be ignored.
        return self.scope["http_version"] == "1.1" and super()._should_upgrade()

    def _refuse(self, status: int, detail: str, *headers: str) -> None:
        """Send a refusal, and close; no other answer may be under way."""
        self._is_refused = True
        self.transport.write(refusal(status, detail, *headers))
        # If closed at once while the client is still sending, the connection would be reset, and
        # the answer lost.
        if self.transport.can_write_eof():
            with suppress(OSError):  # the client has left, which has not been noticed yet
                self.transport.write_eof()
        self.loop.call_later(CLOSE_GRACE_S, self.transport.close)
        self._wait_for_request()

    def _parse(self) -> None:
        """Give the parser one whole head, its body, and the next one after the answer."""
        while self._unparsed and not self._is_over:
            if self.conn.left and self.conn.their_state is h11.SEND_BODY:
                body = bytes(self._unparsed[: self.conn.left])
                del self._unparsed[: len(body)]
                self.conn.left -= len(body)
                super().data_received(body)
                continue
            if self.conn.their_state is not h11.IDLE:
                self.flow.pause_reading()  # until the answer has gone
                return
            blank = _BLANK_LINE.search(self._unparsed, 0, MAX_HEAD_BYTES)
            end = min(len(self._unparsed), MAX_HEAD_BYTES) if blank is None else blank.end()
            if self._unparsed.count(b"\n", 0, end) > MAX_LINES:
                self._refuse(
                    431, f"the request's head has more than {MAX_HEADERS} headers, the limit"
                )
            elif blank is None and end == MAX_HEAD_BYTES:
                self._refuse(
                    431, f"the request's head has more than {MAX_HEAD_BYTES} bytes, the limit"
                )
            elif blank is None and self._unparsed[0] > 0x20:
                return  # the rest is on its way; a byte up to 0x20 begins no request, but maybe TLS
            else:
                head = bytes(self._unparsed[:end])
                del self._unparsed[:end]
                super().data_received(head)
        if self._is_over:
            self._unparsed.clear()

    @property
    def _is_over(self) -> bool:
        """Whether no more input is taken here."""
        return self._is_refused or self._is_handed_over or self.transport.is_closing()

    @property
    def _is_at_work(self) -> bool:
        cycle = cast("RequestResponseCycle | None", self.cycle)
        return cycle is not None and not cycle.response_complete

    def _wait_for_request(self) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
        self._idle_since_s = self.loop.time()
        self._deadline = self.loop.call_later(self.timeout_keep_alive, self._abort_if_idle)

    def _stop_waiting(self) -> None:
        for deadline in (self._deadline, self._reader_deadline):
            if deadline is not None:
                deadline.cancel()
        self._deadline = self._reader_deadline = None

    def _abort_if_idle(self) -> None:
        if not self._is_at_work:
            self.abort()

    def _give_up(self) -> None:
        self._reader_deadline = None
        log.warning("disconnected a reader that accepted nothing for %g s", self.timeout_keep_alive)
        self.abort()


# --- an answer, piece by piece --------------------------------------------------------------------

# Size of a piece of a body: the next one follows when the socket has taken it.
PIECE_BYTES: Final = 64 * 1024


def pieces_of(message: Message) -> Iterator[Message]:
    """A message of an answer as messages with no more than `PIECE_BYTES` of body."""
    body = message.get("body", b"")
    if len(body) <= PIECE_BYTES:
        yield message
        return
    body = memoryview(body)  # pieces are views: a hundred readers share one body
    for start in range(0, len(body), PIECE_BYTES):
        yield {**message, "body": body[start : start + PIECE_BYTES], "more_body": True}
    # uvicorn waits before it writes: the empty last message waits for the last piece.
    yield {**message, "body": b""}


class PieceByPiece:
    """ASGI middleware that sends an answer in pieces, each when its reader has taken the last."""

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
