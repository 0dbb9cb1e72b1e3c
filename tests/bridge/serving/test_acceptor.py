"""Connections to a bridge with few file descriptors: idle ones are evicted for new ones."""

import asyncio
import resource
import ssl
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from lupin_bridge.serving.connections import (
    MIN_CONNECTIONS,
    SPARE_FILES,
    Acceptor,
    room_for_connections,
)
from lupin_bridge.serving.server import address_of, listen
from tests.support import raw_http
from tests.support.access import Served
from tests.support.domains import own_domain, ros_env
from tests.support.proc_stat import open_files
from tests.support.processes import Process, limits, url_of
from tests.support.tls import certificate
from tests.support.waiting import PATIENCE_S, until, wait_for
from tests.support.web import deaf_client

FILES = 256
STUCK = 250
GET = b"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n"


@pytest.fixture(scope="module")
def shared() -> Iterator[tuple[Served, int]]:
    """`lupin-twin serve` with at most `FILES` open files, and how many it has open."""
    shell = ["/bin/sh", "-c", f'ulimit -n {FILES} && exec "$@"', "sh"]
    # No deadline ends a waiting client. There is no journal, since the past process needs files
    # too.
    command = [
        *(sys.executable, "-m", "tests.support.limited", "serve", "--port", "0"),
        *limits(client_timeout_s=3_600),
        *("--ros-args", "-p", "journal:=off"),
    ]
    with own_domain() as domain, Process([*shell, *command], ros_env(domain)) as process:
        live = Served(process, url_of(process))
        assert live.get("/healthz").status_code == 200
        yield live, open_files(process.pid)
        assert "Traceback" not in process.output
        assert len(process.output) < 6_000, "a line for all of them, now and then"


@pytest.fixture
def live(shared: tuple[Served, int]) -> Iterator[Served]:
    """The same bridge, with no connections left."""
    served, files = shared
    yield served
    wait_for(lambda: open_files(served.process.pid) <= files, "the end of all connections")


@pytest.mark.parametrize(
    "message",
    [
        b"",
        b"GET /ws/state HTTP/1.1\r\nHost: 127.0.0.1\r\nX-Slow: ",
        GET.replace(b"Connection: close\r\n", b""),
    ],
    ids=["nothing", "half a request", "a request, and no more"],
)
def test_an_idle_connection_is_evicted_for_an_active_one(live: Served, message: bytes) -> None:
    with ExitStack() as stack:
        stored = open_files(live.process.pid)
        for _ in range(STUCK):
            stack.enter_context(raw_http.connect(live.url)).sendall(message)
        for _ in range(20):
            assert raw_http.status(raw_http.answer(live.url, GET)) == 200
        assert live.handshake() == 101
        assert open_files(live.process.pid) <= FILES - SPARE_FILES // 2
        assert open_files(live.process.pid) >= stored
        live.process.wait_for_output("evicted the ")


def test_one_address_evicts_only_its_own_connections(live: Served) -> None:
    with ExitStack() as stack:
        quiet = stack.enter_context(raw_http.connect(live.url, "127.0.7.1"))
        quiet.sendall(GET[:-2])
        others = [
            stack.enter_context(raw_http.connect(live.url, "127.0.7.2")) for _ in range(2 * STUCK)
        ]
        assert others[0].recv(1) == b"", "it made room for the last of its own"
        quiet.sendall(GET[-2:])
        assert raw_http.status(raw_http.received(quiet)) == 200


def test_websockets_leave_room_for_requests_and_stay(live: Served) -> None:
    with ExitStack() as stack:
        line = live.process.wait_for_output("--max-clients is 5000")
        listeners = [stack.enter_context(deaf_client(live.url)) for _ in range(FILES)]

        # Those without a place get the reason, and stay long enough to read it, unless others
        # come.
        assert all(raw_http.status(raw_http.answer(live.url, GET)) == 200 for _ in range(20))
        served_clients = int(line.rpartition("serving ")[2].split()[0])
        assert FILES // 8 < served_clients < FILES // 2

        def open_websockets() -> int:
            text = raw_http.answer(live.url, GET.replace(b"healthz", b"metrics")).decode()
            return int(float(text.partition("\nlupin_clients ")[2].split()[0]))

        wait_for(
            lambda: open_websockets() == served_clients, "as many clients as there is room for"
        )
        assert len(listeners) == FILES


def test_out_of_files_it_waits_logs_so_once_and_recovers(live: Served) -> None:
    with ExitStack() as stack:
        pid = live.process.pid
        # By its count, all of its files are open, and none of them is a connection.
        resource.prlimit(pid, resource.RLIMIT_NOFILE, (open_files(pid) - 1, FILES))
        waiting = [stack.enter_context(raw_http.connect(live.url)) for _ in range(50)]
        for client in waiting:
            client.sendall(GET)
        live.process.wait_for_output("no new connections for now: Too many open files")
        resource.prlimit(pid, resource.RLIMIT_NOFILE, (FILES, FILES))
        assert all(raw_http.status(raw_http.received(client)) == 200 for client in waiting)
        assert live.process.output.count("no new connections") == 1


async def test_no_connection_is_evicted_before_another_one_comes() -> None:
    room = 3

    class Waiting(asyncio.Protocol):
        client = None
        waiting_since_s = 0.0

        def connection_made(self, transport: asyncio.BaseTransport) -> None:
            assert isinstance(transport, asyncio.Transport)
            self.abort = transport.abort
            guests.append(self)

        def connection_lost(self, _: Exception | None) -> None:
            guests.remove(self)
            lost.append(self)

    guests: list[Waiting] = []
    lost: list[Waiting] = []

    with listen("127.0.0.1", 0) as listener, ExitStack() as stack:
        for _ in range(room):
            stack.enter_context(raw_http.connect(address_of(listener)))
        door = Acceptor(listener, Waiting, guests, room=room, tls=None, timeout_s=PATIENCE_S)
        await until(lambda: len(guests) == room, "all who wait outside")
        first = guests[0]
        stack.enter_context(raw_http.connect(address_of(listener)))
        await until(lambda: lost and len(guests) == room, "one more")
        assert lost == [first]
        door.close()
        await door.wait_closed()
        stack.close()
        await until(lambda: not guests, "their end")


async def test_an_unfinished_tls_handshake_is_evicted_too(tmp_path: Path) -> None:
    ours, tls = certificate(tmp_path), ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    tls.load_cert_chain(ours.cert, ours.key)
    with listen("127.0.0.1", 0) as listener, ExitStack() as stack:
        door = Acceptor(listener, asyncio.Protocol, [], room=2, tls=tls, timeout_s=PATIENCE_S)
        url = address_of(listener)
        first, *others = (stack.enter_context(raw_http.connect(url)) for _ in range(3))
        await until(lambda: raw_http.is_over(first), "its place")
        assert not any(map(raw_http.is_over, others))
        door.close()
        await door.wait_closed()


def test_the_room_is_what_the_limit_leaves(monkeypatch: pytest.MonkeyPatch) -> None:
    limits = [(10_000, 10_000)]
    monkeypatch.setattr(resource, "getrlimit", lambda _: limits[-1])
    room = room_for_connections()
    assert 9_000 < room < 10_000 - SPARE_FILES
    limits.append((10_100, 10_100))
    assert room_for_connections() == room + 100
    limits.append((SPARE_FILES, SPARE_FILES))
    assert room_for_connections() == MIN_CONNECTIONS
    limits.append((resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    assert room_for_connections() > 100_000
