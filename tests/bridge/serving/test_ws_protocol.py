"""The connection below the hub: real sockets, some of which are not read."""

import asyncio
import socket

import pytest
from websockets.frames import CloseCode

from lupin_bridge.serving import ws_protocol
from lupin_bridge.serving.admission import Limits
from lupin_bridge.serving.ws_protocol import Connection
from tests.support import raw_http
from tests.support.inprocess import Running, running
from tests.support.raw_ws import BINARY, CLOSE, TEXT, RawClient, frames_of, masked
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
        (masked(BINARY, bytes(65_537)), CloseCode.MESSAGE_TOO_BIG),  # as SECURITY.md says
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
            client.socket.sendall(message + masked(BINARY, bytes(1_000)) * 200)
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
