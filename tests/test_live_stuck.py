"""Clients that do not read, vanish, trickle, flood or are too many.

Over real sockets and a real bridge with a robot that changes it at 50 Hz. Each time those clients
are gone in the end, memory stays within a bound, and a healthy client gets every kind of frame as
usual.
"""

import ctypes
import socket
import struct
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from typing import Any

import httpx
import pytest
from websockets.exceptions import ConnectionClosed

from lupin_bridge.serving.server import MAX_INBOUND_BYTES
from lupin_bridge.serving.ws_protocol import FRAMES_AT_ONCE, MAX_PIECES
from tests.bench.live_parts import Server, serving
from tests.support.foxglove import viewer
from tests.support.proc_stat import open_files, peak_mb, reset_peak, resident_mb
from tests.support.processes import limits
from tests.support.raw_http import connect as connect_from
from tests.support.raw_http import handshake, is_over
from tests.support.raw_ws import CLOSE, CONT, TEXT, RawClient, masked
from tests.support.rosbridge import ros_at
from tests.support.waiting import PATIENCE_S, wait_for
from tests.support.web import Listener, bridge, deaf_client, listener
from tests.support.ws_client import last_word

CLIENTS = 20
TIMEOUT_S = 2
SELDOM_HZ = 10.0
# For all of them together; a state of the robot's 30 tags has 23 kB, 1.1 MB a second for each. The
# twin itself takes some 15 MB of it meanwhile, fitting models.
MEMORY_MB = 25.0

PATIENT: dict[str, Any] = {"timeout": PATIENCE_S, "trust_env": False}
PING = b"\x89\x80abcd"
EMPTY_TEXT = b"\x81\x80abcd"


@pytest.fixture(scope="module")
def server() -> Iterator[Server]:
    with serving(30, 50.0, *limits(client_timeout_s=TIMEOUT_S)) as running:
        yield running


@pytest.fixture
def healthy(server: Server) -> Iterator[Listener]:
    """On a busy machine, a client of everything may be as slow as those that are to go."""
    with listener(url(server), max_rate_hz=SELDOM_HZ) as client:
        client.until("state")
        yield client
        assert "Traceback" not in server.process.output


def url(server: Server) -> str:
    return f"http://127.0.0.1:{server.port}"


def metric(server: Server, name: str) -> float:
    """A metric without labels."""
    answer = httpx.get(f"{url(server)}/metrics", **PATIENT)
    for line in answer.text.splitlines():
        if line.startswith(f"{name} "):
            return float(line.rpartition(" ")[2])
    raise AssertionError(f"there is no metric {name}")


def vanish(client: socket.socket) -> None:
    """Let a client's machine vanish: no packet gets in any more, so none is ever answered.

    socket(7), SO_ATTACH_FILTER with the one instruction "return 0", which drops every packet.
    """
    instructions = ctypes.create_string_buffer(struct.pack("HBBI", 0x06, 0, 0, 0))
    program = struct.pack("HL", 1, ctypes.addressof(instructions))
    client.setsockopt(socket.SOL_SOCKET, 26, program)


def trickle(client: socket.socket) -> None:
    client.settimeout(0)
    with suppress(OSError):
        client.recv(1)


def wait_reading(healthy: Listener, check: Callable[[], bool], what: str) -> None:
    """Wait on a condition, with the healthy client reading all the while."""

    def read_and_check() -> bool:
        healthy.rest()
        return check()

    wait_for(read_and_check, what)


def latest(client: Listener) -> int:
    """The number of the latest frame that is there."""
    client.rest()
    return int(client.until("state")["seq"])


@contextmanager
def gone_in_the_end(server: Server, healthy: Listener) -> Iterator[ExitStack]:
    """Connections opened inside are gone at the end, and have cost little meanwhile."""
    clients, files = metric(server, "lupin_clients"), open_files(server.process.pid)
    memory = resident_mb(server.process.pid)
    reset_peak(server.process.pid)
    with ExitStack() as stack:
        yield stack
        wait_reading(healthy, lambda: metric(server, "lupin_clients") <= clients, "the others' end")
        wait_reading(
            healthy, lambda: open_files(server.process.pid) <= files, "the end of their sockets"
        )
        assert peak_mb(server.process.pid) - memory < MEMORY_MB
        seq = latest(healthy)
        assert latest(healthy) > seq


def test_clients_that_do_not_read_are_gone_after_the_timeout(
    server: Server, healthy: Listener
) -> None:
    """A third each: without a read, vanished, or with a byte now and then."""
    dismissed = metric(server, "lupin_clients_dismissed_total")
    with gone_in_the_end(server, healthy) as stack:
        stuck = [stack.enter_context(deaf_client(url(server))) for _ in range(CLIENTS)]
        wait_reading(
            healthy,
            lambda: (
                metric(server, "lupin_clients") + metric(server, "lupin_clients_dismissed_total")
                >= dismissed + 1 + CLIENTS
            ),
            "all to be connected",
        )
        for client in stuck[::3]:
            vanish(client)

        def all_dismissed() -> bool:
            for client in stuck[1::3]:
                trickle(client)
            return metric(server, "lupin_clients_dismissed_total") == dismissed + CLIENTS

        wait_reading(healthy, all_dismissed, "all to be dismissed")


def half_request(client: socket.socket) -> None:
    client.sendall(b"GET /ws/state HTTP/1.1\r\nHost: 127.0.0.1\r\nX-Slow: ")


def answered_before(client: socket.socket) -> None:
    client.sendall(b"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
    while b"}" not in (block := client.recv(4096)):
        assert block, "it has ended"
    half_request(client)


def half_body(client: socket.socket) -> None:
    client.sendall(b"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 9999\r\n\r\n")


def test_a_request_that_arrives_byte_by_byte_is_gone_after_the_timeout(
    server: Server, healthy: Listener
) -> None:
    with gone_in_the_end(server, healthy) as stack:
        every = []
        for begin in (lambda _: None, half_request, answered_before, half_body):
            slow = stack.enter_context(socket.create_connection(("127.0.0.1", server.port)))
            slow.settimeout(PATIENCE_S)
            begin(slow)
            every.append(slow)

        def is_removed(slow: socket.socket) -> bool:
            try:
                slow.send(b"x")
            except OSError:
                return True
            return is_over(slow)

        wait_reading(healthy, lambda: all(map(is_removed, every)), "their end")


@pytest.mark.parametrize("frame", [PING, EMPTY_TEXT])
def test_a_flood_ends_its_sender_alone(server: Server, healthy: Listener, frame: bytes) -> None:
    with (
        gone_in_the_end(server, healthy) as stack,
        listener(url(server), max_rate_hz=SELDOM_HZ) as reads,
    ):
        reads.until("state")
        deaf = stack.enter_context(deaf_client(url(server)))
        assert deaf.recv(1) == b"H", "a client must not send before the answer"
        for sender in (reads.connection.socket, deaf):
            # As many as take a server seconds.
            sender.sendall(frame * 20 * FRAMES_AT_ONCE)
        why = "sent more than 100 messages a second after 500 at once"
        assert last_word(reads.connection) == (1008, why)
        wait_reading(healthy, lambda: is_over(deaf), "the end of the one that does not read")


def test_a_message_past_the_limit_is_one_in_pieces_too(server: Server, healthy: Listener) -> None:
    with gone_in_the_end(server, healthy), listener(url(server), max_rate_hz=SELDOM_HZ) as loud:
        pieces = MAX_INBOUND_BYTES // 10_000 + 1
        with suppress(ConnectionClosed):  # it may receive the answer before it has sent everything
            loud.connection.send("x" * 10_000 for _ in range(pieces))
        assert last_word(loud.connection)[0] == 1009


@pytest.mark.parametrize("path", ["/ws/state", "/rosbridge", "/foxglove"])
def test_a_message_has_a_limit_of_pieces_however_small(server: Server, path: str) -> None:
    piece = masked(CONT, b"", fin=False)
    begin = masked(TEXT, b"", fin=False) + piece * (MAX_PIECES - 2)
    bye = masked(CLOSE, b"\x03\xe8")
    with RawClient(url(server), path) as most:
        assert most.exchange(begin + masked(CONT, b"") + bye)[-1] == (CLOSE, b"\x03\xe8")
    with RawClient(url(server), path) as endless:
        message = endless.exchange(begin + piece + masked(CONT, b""))
        assert message[-1] == (CLOSE, b"\x03\xf0sent a message in more than %d pieces" % MAX_PIECES)


def test_one_client_too_many_gets_the_reason_and_may_come_when_another_has_gone() -> None:
    with bridge("--max-clients", "3") as live, ExitStack() as stack:
        inside = [stack.enter_context(live.listen()) for _ in range(3)]
        for client in inside:
            client.until("state")
        connects: Any = (live.listen, partial(ros_at, live.url), partial(viewer, live.url))
        for connect in connects:
            with pytest.raises(ConnectionClosed) as closed, connect() as refused:
                refused.next()
            assert closed.value.rcvd is not None
            assert closed.value.rcvd.code == 1013
            assert closed.value.rcvd.reason == "3 clients are connected, the limit"
        # One address does not take all places from the others.
        other = stack.enter_context(connect_from(live.url, "127.0.9.1"))
        other.sendall(handshake("/foxglove"))
        assert "the limit, 3 of them from here" in last_word(inside.pop().connection)[1]
        inside[0].connection.close()

        def is_let_in() -> bool:
            with live.listen() as client:
                try:
                    return bool(client.next()["type"] == "status")
                except ConnectionClosed:
                    return False

        wait_for(is_let_in, "the place that has become free")
        inside[1].until("state")
        assert not is_over(other)
