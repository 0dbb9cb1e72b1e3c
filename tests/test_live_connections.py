"""Connections that come to nothing: each is answered, or ended, and none stays."""

import socket
import ssl
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from itertools import cycle

import orjson
import pytest

from lupin_bridge.serving.connections import MAX_HEAD_BYTES, MAX_INCOMPLETE_BYTES
from tests.support import raw_http
from tests.support.access import TOKEN, Served, served
from tests.support.proc_stat import cpu_s, open_files, peak_mb, reset_peak, resident_mb
from tests.support.processes import limits
from tests.support.raw_http import UPGRADE, status
from tests.support.tls import certificate
from tests.support.waiting import wait_for

TIMEOUT_S = 2
HOST = b"Host: 127.0.0.1\r\n\r\n"
# The cost of a few thousand refusals, however few of them are read.
MEMORY_MB = 15.0


@pytest.fixture(scope="module")
def plain() -> Iterator[Served]:
    with served(*limits(client_timeout_s=TIMEOUT_S), afresh=True) as running:
        yield running
        assert "Traceback" not in running.process.output


@pytest.fixture(scope="module")
def secret(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    files = certificate(tmp_path_factory.mktemp("tls"))
    options = (*limits(client_timeout_s=TIMEOUT_S), *files.options)
    with served(*options, trust=files.trust, afresh=True, LUPIN_TOKEN=TOKEN) as running:
        yield running
        assert "Traceback" not in running.process.output


def requested(*lines: bytes, version: bytes = b"1.1") -> bytes:
    """A request for a WebSocket with further header lines."""
    head = b"GET /ws/state HTTP/" + version + b"\r\n" + UPGRADE
    return head + b"".join(line + b"\r\n" for line in lines) + b"\r\n"


NO_HANDSHAKES = {
    "a body": requested(b"Content-Length: 1"),
    "a long cookie": requested(b"Cookie: " + b"x" * 9_000),
    "many headers": requested(*(b"X-%d: y" % i for i in range(130))),
    "a long head": requested(*(b"X-%d: " % i + b"y" * 7_000 for i in range(12))),
    "a bad key": requested().replace(b"dGhlIHNhbXBsZSBub25jZQ==", b"dGhl"),
    "another version": requested().replace(b"Version: 13", b"Version: 8"),
    "no text": requested(b"X-Bytes: \xff\xfe", b"Content-Length: \xb9"),
    "TLS": b"\x16\x03\x01\x02\x00\x01\x00",  # a browser at https: must not wait
}


@pytest.mark.parametrize("name", NO_HANDSHAKES)
def test_an_invalid_handshake_is_answered_and_ended(plain: Served, name: str) -> None:
    received = raw_http.answer(plain.url, NO_HANDSHAKES[name])
    assert 400 <= status(received) < 500, received
    assert received.count(b"HTTP/1.1") == 1


def test_a_refusal_has_its_reason(plain: Served) -> None:
    message = {
        "the request has a body (content-length: 1), and none": b"GET / HTTP/1.1\r\n"
        b"Content-Length: 1\r\n" + HOST,
        "Receive buffer too long": requested(b"a: " + b"x" * 40_000),
    }
    for why, request in message.items():
        body = raw_http.answer(plain.url, request).partition(b"\r\n\r\n")[2]
        assert orjson.loads(body)["detail"].startswith(why)


def test_an_unfinished_tls_handshake_ends_after_the_timeout(secret: Served) -> None:
    """And costs little until then: it needs no token."""
    begun = (b"", b"\x16\x03\x01", b"\x16\x03\x01\x02\x00\x01\x00", b"GET")
    files = open_files(secret.process.pid)
    reset_peak(secret.process.pid)
    before_mb = resident_mb(secret.process.pid)
    with ExitStack() as stack:
        clients = [stack.enter_context(raw_http.connect(secret.url)) for _ in range(100)]
        for client, message in zip(clients, cycle(begun), strict=False):
            client.sendall(message)
        wait_for(lambda: all(map(raw_http.is_over, clients)), "their end")
        wait_for(lambda: open_files(secret.process.pid) <= files, "the end of their files")
    assert peak_mb(secret.process.pid) - before_mb < MEMORY_MB


def head_of(length: int, line: int) -> bytes:
    """A whole request of that many bytes, with header lines of `line` bytes each."""
    head = b"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n"
    room = length - len(head) - 2
    head += b"".join(b"X: %b\r\n" % (b"y" * (line - 5)) for _ in range(room // line - 1))
    head += b"X: %b\r\n" % (b"y" * (length - len(head) - 7))
    return head + b"\r\n"


@pytest.mark.parametrize("first", [b"", b"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"])
def test_a_head_has_a_size_limit_however_it_arrives(plain: Served, first: bytes) -> None:
    answers = 2 if first else 1
    for length, expected in (
        (MAX_INCOMPLETE_BYTES, b" 200 "),
        (MAX_HEAD_BYTES + 1, b" 431 "),
        (200_000, b" 431 "),
    ):
        received = raw_http.answer(plain.url, first + head_of(length, 300))
        heads = [part[:5] for part in received.split(b"HTTP/1.1")[1:]]
        assert heads == [b" 200 "] * (answers - 1) + [expected]


def test_pipelined_requests_are_all_answered(plain: Served) -> None:
    one = b"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\nX: " + bytes(b"x" * 20_000) + b"\r\n\r\n"
    last = b"GET /nowhere HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\nGET / and more"
    received = raw_http.answer(plain.url, one * 20 + last)
    assert (received.count(b"HTTP/1.1 200"), received.count(b"HTTP/1.1")) == (20, 21)


# Read and parsed, this would take seconds.
FLOOD_BYTES = 16_000_000
FLOOD_CPU_S = 0.5


def pour(client: socket.socket, what: bytes) -> int:
    """Send it again and again, until the connection ends or `FLOOD_BYTES` have been taken."""
    taken = 0
    with suppress(OSError):
        while taken < FLOOD_BYTES:
            taken += client.send(what)
    return taken


def connected(stack: ExitStack, live: Served, room: int | None = None) -> socket.socket:
    """A client, over TLS if the bridge is."""
    client = stack.enter_context(raw_http.connect(live.url, room=room))
    if isinstance(live.trust, ssl.SSLContext):
        secured = live.trust.wrap_socket(client, server_hostname="127.0.0.1")
        client = stack.enter_context(secured)
    return client


CHUNKS = b"1\r\na\r\n" * 10_000
BODIES = {
    "chunks": (b"GET / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n", CHUNKS),
    "chunks, POST": (b"POST /api/signin HTTP/1.1\r\nTransfer-Encoding: chunked\r\n", CHUNKS),
    "a length": (b"GET / HTTP/1.1\r\nContent-Length: 16000000\r\n", bytes(60_000)),
    "a length, POST": (b"POST /api/signin HTTP/1.1\r\nContent-Length: 8193\r\n", bytes(60_000)),
}


@pytest.mark.parametrize("name", BODIES)
@pytest.mark.parametrize("over", ["tcp", "tls and a token"])
def test_a_body_is_refused_and_not_read(
    plain: Served, secret: Served, name: str, over: str
) -> None:
    live = plain if over == "tcp" else secret
    head, piece = BODIES[name]
    with ExitStack() as stack:
        client = connected(stack, live)
        before_s = cpu_s(live.process.pid)
        client.sendall(head + HOST)
        assert status(client.recv(65_536)) == 413, "before any of the body has come"
        assert pour(client, piece) < FLOOD_BYTES, "the connection ends while it is being sent"
        assert cpu_s(live.process.pid) - before_s < FLOOD_CPU_S


REFUSED = {
    "401": b"GET /api/state HTTP/1.1\r\n" + HOST,
    "401, HEAD": b"HEAD /api/state HTTP/1.1\r\n" + HOST,
    "403": b"GET /api/state HTTP/1.1\r\nHost: evil.example\r\n\r\n",
    "404": b"GET /signin/nowhere HTTP/1.1\r\n" + HOST,
    "404, HEAD": b"HEAD /nowhere HTTP/1.1\r\n" + HOST,
    "405": b"POST /healthz HTTP/1.1\r\nContent-Length: 0\r\n" + HOST,
    "429": b"GET /api/state HTTP/1.1\r\nAuthorization: Bearer wrong\r\n" + HOST,
    "400": b"GET /healthz HTTP/1.1\r\n" + HOST + b"no HTTP\r\n\r\n",
    "400, field": b"GET /api/field?sensor_type= HTTP/1.1\r\n" + HOST,
    "answers": b"GET /healthz HTTP/1.1\r\n" + HOST,
}


@pytest.mark.parametrize("over", ["tcp", "tls and a token"])
def test_a_client_that_reads_no_refusal_is_gone_after_the_timeout(
    plain: Served, secret: Served, over: str
) -> None:
    live = plain if over == "tcp" else secret
    pid = live.process.pid
    files, memory = open_files(pid), resident_mb(pid)
    reset_peak(pid)
    with ExitStack() as stack:
        for refused in REFUSED.values():
            client = connected(stack, live, room=4_096)
            client.settimeout(0.2)
            with suppress(OSError):  # it may no longer be listening
                client.sendall(refused * 3_000)
        wait_for(lambda: open_files(pid) <= files, "their end")
        assert peak_mb(pid) - memory < MEMORY_MB


LARGE_FIELD = (
    b"GET /api/field.npy?sensor_type=co2&resolution=0.01&bbox_min_x=0&bbox_min_y=0"
    b"&bbox_max_x=%d&bbox_max_y=1 HTTP/1.1\r\n" + HOST
)


def test_a_websocket_after_an_unread_answer_stores_nothing(plain: Served) -> None:
    pid = plain.process.pid
    files, memory = open_files(pid), resident_mb(pid)
    reset_peak(pid)
    with ExitStack() as stack:
        # As many large answers as one address may get at once; each exceeds a socket's buffer.
        clients = [stack.enter_context(raw_http.connect(plain.url, room=4_096)) for _ in range(4)]
        for width, client in enumerate(clients, 16):
            client.sendall(LARGE_FIELD % width + requested())
        wait_for(lambda: all(map(raw_http.is_over, clients)), "their end")
        wait_for(lambda: open_files(pid) <= files, "the end of their files")
        assert peak_mb(pid) - memory < 2 * MEMORY_MB


def test_after_an_unread_answer_nothing_more_is_read(plain: Served) -> None:
    with raw_http.connect(plain.url, room=4_096) as client:
        client.sendall(LARGE_FIELD % 16)
        assert pour(client, (b"GET /healthz HTTP/1.1\r\n" + HOST) * 1_000) < FLOOD_BYTES


def test_a_websocket_after_an_answer_stays(plain: Served) -> None:
    with raw_http.connect(plain.url) as client:
        client.sendall(b"GET /healthz HTTP/1.1\r\n" + HOST + requested())
        seen = b""
        # Heartbeats: for longer than a request may take.
        while seen.count(b'"type":"state"') < 2 * TIMEOUT_S + 1:
            block = client.recv(65_536)
            assert block, seen
            seen += block
