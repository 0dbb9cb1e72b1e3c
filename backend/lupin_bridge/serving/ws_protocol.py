"""WebSocket connections that never wait for slow clients, with limits on what clients send.

uvicorn offers an application only `send()`, which waits for a slow client. The fan-out must not
wait: it checks whether a socket is full, and keeps the newest frame until it is not.
"""

from __future__ import annotations

import asyncio
import struct
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final, TypeVar

import orjson
from pydantic import BaseModel, ValidationError
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.frames import CloseCode, Frame
from websockets.protocol import State

from lupin_bridge.serving.admission import RateLimit
from lupin_bridge.serving.connections import (
    CLOSE_GRACE_S,
    CONNECTION_KEY,
    SmallReads,
    tear_down,
)

# --- a client's JSON ------------------------------------------------------------------------------

ModelT = TypeVar("ModelT", bound=BaseModel)

# The messages that we understand have some hundred bytes at most.
MAX_MESSAGE_LENGTH: Final = 16_384


def members_of(message: str | bytes) -> dict[str, Any]:
    """The members of a JSON object.

    Raises:
        ValueError: not an object, or past a limit; the text says which.

    """
    if isinstance(message, bytes):
        raise ValueError("a binary frame is refused, expected JSON text")  # noqa: TRY004
    if len(message) > MAX_MESSAGE_LENGTH:
        raise ValueError(
            f"the message has {len(message)} characters, the limit is {MAX_MESSAGE_LENGTH}"
        )
    try:
        members = orjson.loads(message)
    except ValueError as error:
        raise ValueError(f"the message is not JSON: {error}") from None
    if not isinstance(members, dict):
        raise ValueError(f"the message is {shown(members)}, expected an object")  # noqa: TRY004
    return members


def model_of(kind: type[ModelT], members: Mapping[str, Any]) -> ModelT:
    """The members as a model.

    Raises:
        ValueError: one of them is invalid; the text names it and its value.

    """
    try:
        return kind.model_validate(members)
    except ValidationError as error:
        first = error.errors(include_url=False, include_context=False)[0]
        (name, *inside), why = first["loc"], first["msg"]
        if len(inside) > 1:  # in an entry of a list
            name = f"{name}[{inside[0]}].{inside[1]}"
        value = "" if first["type"] == "missing" else f" is {shown(first['input'])}"
        raise ValueError(f"{str(name)[:64]}{value}: {why[0].lower()}{why[1:]}") from None


def shown(value: object) -> str:
    """A value as a refusal quotes it: short, and without what is inside it."""
    if isinstance(value, dict | list):
        return "an object" if isinstance(value, dict) else "an array"
    text = repr(value)
    return text if len(text) <= 64 else text[:63] + "…"


# --- a large message as a series of small frames, whose payloads are views of it ------------------

# asyncio copies what a socket does not take: a map for a hundred clients that do not read, a
# hundred times. So each client gets the next piece when it has taken the one before, and all of
# them share the message. A ping, its answer and a close may come between two pieces (RFC 6455,
# section 5.4).
PIECE_BYTES: Final = 131_072

# A frame's head, perhaps with the beginning of its payload, and what follows it.
Piece = tuple[bytes, bytes | memoryview]

# The first byte of a whole binary message.
BINARY: Final = 0x82
_FIN: Final = 0x80
_OPCODE: Final = 0x0F
_CONTINUATION: Final = 0


def pieces(frame: bytes, rest: bytes = b"") -> Iterator[Piece]:
    """Yield a whole message as frames of `PIECE_BYTES` at most; a small one stays as it is.

    `frame` is unmasked; its head has the whole length. `rest` is the payload that is not in it.
    """
    if len(frame) + len(rest) <= PIECE_BYTES:
        yield frame, rest
        return
    head_bytes = {126: 4, 127: 10}.get(frame[1], 2)
    parts = [part for part in (memoryview(frame)[head_bytes:], memoryview(rest)) if part]
    opcode = frame[0] & _OPCODE
    for part in parts:
        for start in range(0, len(part), PIECE_BYTES):
            payload = part[start : start + PIECE_BYTES]
            is_last = part is parts[-1] and start + PIECE_BYTES >= len(part)
            yield frame_head(opcode | (_FIN if is_last else 0), len(payload)), payload
            opcode = _CONTINUATION


def frame_head(first: int, length: int) -> bytes:
    """The head of a frame of `length` payload bytes; a server does not mask (RFC 6455, 5.1)."""
    if length < 126:
        return bytes((first, length))
    if length < 1 << 16:
        return struct.pack("!BBH", first, 126, length)
    return struct.pack("!BBQ", first, 127, length)


# --- a connection ---------------------------------------------------------------------------------

# A page subscribes a few times as it opens, a layout with twenty panels twenty times, and both
# hardly ever after that. Nobody gets more than 50 fields a second anyway.
FRAMES_PER_S = 100
FRAMES_AT_ONCE = 500
# Fragments of one message. The parser bounds their size, not their number: it would keep an endless
# series of empty ones.
MAX_PIECES = 400


class Connection(WebSocketsSansIOProtocol, SmallReads):
    """uvicorn's protocol, which also puts itself into `scope["state"]["connection"]`."""

    def __init__(
        self,
        config: Any,
        server_state: Any,
        app_state: dict[str, Any],
        _loop: asyncio.AbstractEventLoop | None = None,
    ) -> None:
        super().__init__(config, server_state, {**app_state, CONNECTION_KEY: self}, _loop)
        # uvicorn's time-out for the client's answer to a close, by default ten seconds.
        self.close_timeout = CLOSE_GRACE_S
        self.on_writable: Callable[[], None] | None = None
        self._pace = RateLimit(FRAMES_PER_S, FRAMES_AT_ONCE)
        # What is left of large messages, for as long as the socket does not take it.
        self._pieces: deque[Piece] = deque()
        self._is_full = False
        self._check: asyncio.TimerHandle

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Have the socket count as full at its first unsent byte: one frame is queued at most.

        Over TLS, asyncio buffers another 64 kB below the limit that can be set.
        """
        super().connection_made(transport)
        # uvicorn does so later. Over TLS something may be unsent when the limits are set: the HTTP
        # protocol would be notified, wait for a reader not its own, and cut the client off.
        self.transport.set_protocol(self)
        # Not 0: asyncio's TLS transport stops at the limit, not past it, and would stop on nothing.
        self.transport.set_write_buffer_limits(high=1, low=0)
        # An earlier HTTP answer may still fill the socket. Then the HTTP protocol was notified.
        if self.transport.get_write_buffer_size() > 0:
            self.pause_writing()
        self._check_later()

    def _check_later(self) -> None:
        self._check = self.loop.call_later(self.config.timeout_keep_alive, self._end_unless_open)

    def _end_unless_open(self) -> None:
        # An answer that nobody reads may be before the handshake's, or before the close.
        if not self.handshake_complete or self.transport.is_closing():
            self.abort()
        else:
            self._check_later()

    @property
    def waiting_since_s(self) -> float | None:
        """For ever, if it is being closed; None: it is open, and is not evicted for others."""
        return 0.0 if self.close_sent or self.transport.is_closing() else None

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget the connection, which the timer would keep."""
        self._check.cancel()
        self._pieces.clear()
        super().connection_lost(exc)

    def abort(self) -> None:
        """Tear the connection down and forget what was still to be sent."""
        tear_down(self.transport)

    def data_received(self, data: bytes) -> None:
        """Take bytes: first of all the whole request for the handshake, which may be refused."""
        if self.transport.is_closing():
            return  # over TLS, more may come
        super().data_received(data)
        error = self.conn.handshake_exc
        if error is not None and not self.handshake_initiated:
            # uvicorn would wait for ever. websockets has an answer to some errors.
            text = f"this is no request for a WebSocket: {error.__cause__ or error}"
            answer = b"".join(self.conn.data_to_send())
            self.transport.write(answer or self.conn.reject(400, text[:500]).serialize())
            self.transport.close()

    def handle_events(self) -> None:
        """Handle the frames that a client has sent, unless it sends too many."""
        if self._pace.take("", self.loop.time(), len(self.conn.events)) == 0.0:
            super().handle_events()
        else:
            self._dismiss_for(
                f"sent more than {FRAMES_PER_S} messages a second after {FRAMES_AT_ONCE} at once"
            )

    def pause_writing(self) -> None:
        """Note that the socket takes no more."""
        self._is_full = True
        super().pause_writing()

    def resume_writing(self) -> None:
        """Write the next piece, or the newest frame: the socket has taken everything."""
        self._is_full = False
        self._write_pieces()
        if self._is_full:
            return
        super().resume_writing()
        if self.on_writable is not None:
            self.on_writable()

    async def send(self, message: Any) -> None:
        """Pass a message on; a handshake that was refused counts as complete.

        Otherwise uvicorn would think that the application forgot it, and log an error for each.
        """
        await super().send(message)
        if message["type"] == "websocket.http.response.body" and self.close_sent:
            self.handshake_complete = True

    def handle_cont(self, event: Frame) -> None:
        """Take a further piece of a message."""
        if len(self.frames) < MAX_PIECES:
            super().handle_cont(event)
        else:
            self._dismiss_for(f"sent a message in more than {MAX_PIECES} pieces")

    def _dismiss_for(self, reason: str) -> None:
        self.transport.pause_reading()
        self.dismiss(CloseCode.POLICY_VIOLATION, reason)

    def handle_parser_exception(self) -> None:
        """Close with the reason, if input breaks the protocol or a limit; drop further input."""
        close = self.conn.close_sent
        if close is None or self.close_sent:
            return  # the parser repeats its complaint with whatever else comes
        self.queue.put_nowait(
            {"type": "websocket.disconnect", "code": close.code, "reason": close.reason}
        )
        self._send_close()

    @property
    def can_take(self) -> bool:
        """Whether everything written so far has gone out, and more may follow."""
        return self.writable.is_set() and not self.close_sent and not self.transport.is_closing()

    def write(self, wire: bytes) -> None:
        """Write a whole frame; never waits. The caller has checked `can_take`."""
        self.transport.write(wire)

    def write_shared(self, frame: bytes, rest: bytes = b"") -> None:
        """Write a message that others get too, without copying it; see `pieces`. Never waits."""
        self._pieces.extend(pieces(frame, rest))
        self._write_pieces()

    def _write_pieces(self) -> None:
        while self._pieces and not self._is_full:
            if self.close_sent or self.transport.is_closing():
                self._pieces.clear()
            else:
                self.transport.writelines(self._pieces.popleft())

    def dismiss(self, code: int, reason: str) -> None:
        """Send a close frame with the reason, and tear the socket down if nobody reads it."""
        if self.conn.state is State.OPEN and not self.transport.is_closing():
            self.conn.send_close(code, reason)
            self._send_close()
        else:
            self.loop.call_later(CLOSE_GRACE_S, self.abort)

    def _send_close(self) -> None:
        """Write the close frame that the parser has ready, and tear down after `CLOSE_GRACE_S`."""
        self._pieces.clear()
        self.transport.write(b"".join(self.conn.data_to_send()))
        self.close_sent = True
        # uvicorn's attribute: while it is set, the application's end does not end the connection.
        self.close_timer = self.loop.call_later(CLOSE_GRACE_S, self.abort)
