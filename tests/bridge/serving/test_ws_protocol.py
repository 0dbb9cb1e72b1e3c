"""The connection below the hub, its messages, and sockets that nobody reads."""

import asyncio
import fcntl
import socket
import ssl
import struct
import termios
from collections.abc import AsyncIterator, Callable
from contextlib import ExitStack, asynccontextmanager
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from websockets.frames import CloseCode, Frame, Opcode
from websockets.protocol import CLIENT, State
from websockets.protocol import Protocol as Reader

from lupin_bridge.serving import ws_protocol
from lupin_bridge.serving.admission import Limits
from lupin_bridge.serving.connections import UNSENT_BYTES, bound_unsent, reset, tear_down
from lupin_bridge.serving.ws_protocol import (
    BINARY,
    MAX_MESSAGE_LENGTH,
    PIECE_BYTES,
    Connection,
    frame_head,
    members_of,
    pieces,
)
from lupin_bridge.stream.frames import text_frame
from tests.support import raw_http
from tests.support.inprocess import Running, running
from tests.support.raw_ws import BINARY as RAW_BINARY
from tests.support.raw_ws import CLOSE, TEXT, RawClient, frames_of, masked
from tests.support.tls import Certificate, certificate
from tests.support.waiting import PATIENCE_S, until
from tests.support.web import deaf_client

# Silent by itself: every frame is caused by the test, or is a heartbeat of the bridge.
SILENT = ("--ros-args", "-p", "state_publish_rate_hz:=0.01")
BLOCK = 65_536
SMALL_FRAME = b"x" * 1_000


async def joined(served: Running) -> Connection:
    """The connection of the only client, once it is a WebSocket: until then it belongs to HTTP."""

    def check() -> Connection | None:
        for connection in served.server.server_state.connections:
            if isinstance(connection, Connection) and connection.on_writable is not None:
                return connection
        return None

    found = await until(check, "the client to have joined")
    assert found is not None
    return found


@pytest.mark.parametrize("is_dismissed", [False, True])
async def test_after_an_answer_that_nobody_reads_a_handshake_ends_at_the_timeout_or_when_dismissed(
    domain: int, is_dismissed: bool
) -> None:
    limits = Limits(client_timeout_s=5 * PATIENCE_S if is_dismissed else 3.0)
    async with running(limits, SILENT) as served:
        connections = served.server.server_state.connections

        def handed_over() -> Connection | None:
            return next((it for it in connections if isinstance(it, Connection)), None)

        with raw_http.connect(served.url, room=4_096) as deaf:
            await until(lambda: connections, "the connection")
            [plain] = connections
            plain.transport.write(bytes(10_000_000))  # as if it were an answer
            deaf.sendall(b"GET /ws/state HTTP/1.1\r\n" + raw_http.UPGRADE + b"\r\n")
            connection = await until(handed_over, "its handover")
            assert connection is not None
            assert not connection.can_take
            if is_dismissed:  # as when its session has ended
                connection.dismiss(CloseCode.POLICY_VIOLATION, "the session has ended")
            await until(lambda: not connections, "its end")


async def test_a_client_that_does_not_read_ends_after_its_close_frame(domain: int) -> None:
    async with running(Limits(client_timeout_s=3.0), SILENT) as served:
        with deaf_client(served.url) as deaf:
            connection = await joined(served)
            while connection.can_take:
                connection.write(SMALL_FRAME)
            deaf.sendall(masked(CLOSE, b"\x03\xe8"))
            await until(lambda: not served.server.server_state.connections, "its end")


@pytest.mark.parametrize(
    ("message", "code"),
    [
        (masked(RAW_BINARY, bytes(65_537)), CloseCode.MESSAGE_TOO_BIG),  # as SECURITY.md says
        (masked(TEXT, b"\xff"), CloseCode.INVALID_DATA),
        (masked(TEXT, b"", rsv=1), CloseCode.PROTOCOL_ERROR),
    ],
)
async def test_a_refused_client_can_read_the_reason(
    domain: int, monkeypatch: pytest.MonkeyPatch, message: bytes, code: CloseCode
) -> None:
    # However long a busy machine takes to send and to receive it.
    monkeypatch.setattr(ws_protocol, "CLOSE_GRACE_S", PATIENCE_S)

    def send_and_receive(url: str) -> None:
        with RawClient(url, "/ws/state") as client:
            client.socket.sendall(message + masked(RAW_BINARY, bytes(1_000)) * 200)
            data = client.received
            while not (frames := list(frames_of(data))) or frames[-1][0] != CLOSE:
                block = client.socket.recv(BLOCK)
                assert block, "it ended without a reason"
                data += block
            assert int.from_bytes(frames[-1][1][:2]) == code
            # No reset: the system would drop what was not read by then.
            client.socket.shutdown(socket.SHUT_WR)
            assert client.socket.recv(BLOCK) == b""

    async with running(ros_args=SILENT) as served:
        await asyncio.to_thread(send_and_receive, served.url)


def refusal(message: str | bytes) -> str:
    with pytest.raises(ValueError, match=r".") as caught:
        members_of(message)
    return str(caught.value)


def test_only_an_object_is_accepted_and_a_too_long_message_is_not_parsed() -> None:
    assert members_of('{"a": [1]}') == {"a": [1]}
    assert refusal(b"{}") == "a binary frame is refused, expected JSON text"
    assert refusal("[]") == "the message is an array, expected an object"
    assert refusal("3") == "the message is 3, expected an object"
    assert refusal("{").startswith("the message is not JSON: ")
    assert refusal('{"a": NaN}').startswith("the message is not JSON: ")
    longest = '{"x":"' + "x" * (MAX_MESSAGE_LENGTH - 8) + '"}'
    assert len(members_of(longest)["x"]) == MAX_MESSAGE_LENGTH - 8
    assert refusal(longest + " ") == "the message has 16385 characters, the limit is 16384"


@pytest.mark.parametrize(("opening", "closing"), [("[", "]"), ('{"a":', "}")])
def test_deep_nesting_is_refused(opening: str, closing: str) -> None:
    # orjson has its own limit; without it, thousands of levels would crash the process.
    levels = (MAX_MESSAGE_LENGTH - 8) // len(opening + closing)
    for end in ("", f"0{closing * levels}}}"):
        text = refusal(f'{{"x":{opening * levels}{end}')
        assert text.startswith("the message is not JSON: ")


def read(wire: bytes) -> list[Frame]:
    """The frames, parsed by a client that rejects protocol errors."""
    reader = Reader(CLIENT, state=State.OPEN, max_size=None)
    reader.receive_data(wire)
    assert reader.parser_exc is None
    return [event for event in reader.events_received() if isinstance(event, Frame)]


def wire(frame: bytes, rest: bytes = b"") -> bytes:
    return b"".join(bytes(block) for piece in pieces(frame, rest) for block in piece)


# RFC 6455, section 5.2: the length encoding changes at 126 and 65,536.
@pytest.mark.parametrize(
    "length",
    [
        0,
        125,
        126,
        65_535,
        65_536,
        PIECE_BYTES,
        PIECE_BYTES + 1,
        3 * PIECE_BYTES,
        3 * PIECE_BYTES + 1,
    ],
)
def test_a_message_stays_the_same_and_no_piece_exceeds_the_limit(length: int) -> None:
    message = bytes(n % 251 for n in range(length))
    for given, rest, opcode in (
        (text_frame(message), b"", Opcode.TEXT),
        (frame_head(BINARY, len(message)) + message[:13], message[13:], Opcode.BINARY),
    ):
        frames = read(wire(given, rest))
        assert b"".join(frame.data for frame in frames) == message
        assert max(len(frame.data) for frame in frames) <= PIECE_BYTES
        assert [frame.opcode for frame in frames] == [opcode, *[Opcode.CONT] * (len(frames) - 1)]
        assert [frame.fin for frame in frames] == [*[False] * (len(frames) - 1), True]


def test_a_ping_fits_between_two_pieces_and_nothing_is_copied() -> None:
    row = pieces(frame_head(BINARY, 200_000) + bytes(200_000))
    first, *others = (head + bytes(payload) for head, payload in row)
    ping = Frame(Opcode.PING, b"?").serialize(mask=False)
    assert [frame.opcode for frame in read(first + ping + b"".join(others))] == [
        Opcode.BINARY,
        Opcode.PING,
        Opcode.CONT,
    ]
    message = bytes(300_000)
    views = [payload for _, payload in pieces(frame_head(BINARY, len(message)), message)]
    assert all(it.obj is message for it in views if isinstance(it, memoryview))


# More than any socket buffers.
MUCH = bytes(64_000_000)


@asynccontextmanager
async def connection(
    ours: Certificate | None = None,
) -> AsyncIterator[tuple[asyncio.WriteTransport, socket.socket, list[str]]]:
    """Our transport, the other end of its socket, which nobody reads, and whether it has ended."""
    made: list[asyncio.WriteTransport] = []
    ended: list[str] = []

    class Ours(asyncio.Protocol):
        def connection_made(self, transport: asyncio.BaseTransport) -> None:
            assert isinstance(transport, asyncio.WriteTransport)
            made.append(transport)

        def connection_lost(self, _: Exception | None) -> None:
            made[0].close()  # as uvicorn does
            ended.append("it")

    context = None
    if ours is not None:
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        context.load_cert_chain(ours.cert, ours.key)
    soon: dict[str, Any] = {} if context is None else {"ssl_shutdown_timeout": 0.5}
    loop = asyncio.get_running_loop()
    server = await loop.create_server(Ours, "127.0.0.1", 0, ssl=context, **soon)
    with ExitStack() as stack:
        theirs = socket.create_connection(server.sockets[0].getsockname())
        if ours is not None:
            wrap = partial(ours.trust.wrap_socket, theirs, server_hostname="127.0.0.1")
            theirs = await asyncio.to_thread(wrap)
        stack.enter_context(theirs)
        await until(lambda: made, "the connection")
        yield made[0], theirs, ended
    tear_down(made[0])
    server.close()
    await server.wait_closed()


def held_by_the_kernel(transport: asyncio.WriteTransport) -> int:
    """Bytes that the socket has sent and the other end has not received (tcp(7), SIOCOUTQ)."""
    answer = fcntl.ioctl(transport.get_extra_info("socket"), termios.TIOCOUTQ, b"\0" * 4)
    return int(struct.unpack("i", answer)[0])


def hoarded(prepare: Callable[[asyncio.BaseTransport], None], at_least: int) -> int:
    """What the kernel buffers of a large amount that nobody reads, once it is that much."""

    async def test() -> int:
        async with connection() as (transport, *_):
            prepare(transport)
            transport.write(MUCH)
            await until(lambda: held_by_the_kernel(transport) >= at_least, "the kernel to take it")
            return held_by_the_kernel(transport)

    return asyncio.run(test())


def test_the_kernel_buffers_little_for_a_reader_that_does_not_read() -> None:
    assert hoarded(bound_unsent, 1) <= 2 * UNSENT_BYTES
    assert hoarded(lambda _: None, 4 * UNSENT_BYTES), "otherwise this shows nothing"


async def test_a_connection_that_has_read_everything_is_closed() -> None:
    async with connection() as (transport, theirs, _):
        transport.write(b"the end")
        tear_down(transport)
        loop = asyncio.get_running_loop()
        theirs.setblocking(False)
        assert await loop.sock_recv(theirs, 100) == b"the end"
        assert await loop.sock_recv(theirs, 100) == b""


@pytest.mark.parametrize("has_tls", [False, True])
async def test_a_closing_transport_can_be_ended_twice(tmp_path: Path, has_tls: bool) -> None:
    async with connection(certificate(tmp_path) if has_tls else None) as (transport, _, ended):
        for _ in range(2):
            transport.close()
        tear_down(transport)
        await until(lambda: ended, "the end")
        tear_down(transport)
        reset(transport)
