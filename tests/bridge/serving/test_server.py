"""The server with connected clients: its sockets, its limits, how fast it sends, its shutdown."""

import contextlib
import faulthandler
import re
import resource
import select
import signal
import socket
import threading
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from pathlib import Path

import httpx
import pytest
from fastapi import FastAPI
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import unix_connect

from lupin_bridge.cli.roles import FEEDER_STOP_S
from lupin_bridge.feed.ros_thread import STOP_TIMEOUT_S
from lupin_bridge.serving.server import (
    CLOSE_AFTER_S,
    GRACEFUL_SHUTDOWN_S,
    BridgeServer,
    address_of,
    allow_connections,
    listen,
)
from lupin_bridge.settings import Settings
from lupin_twin.runtime.process import END_S, IDLE_WORKERS_END_S
from tests.support import raw_http
from tests.support.access import Served, refused_start, served
from tests.support.domains import own_domain
from tests.support.inprocess import run, running
from tests.support.messages import scan
from tests.support.people import add
from tests.support.processes import Process, faults, limits, lupin_twin, url_of
from tests.support.ros import Peer
from tests.support.waiting import PATIENCE_S, wait_for
from tests.support.web import Listener, bridge, deaf_client, listener, overfill, ws_url

# Too much for the event loop: a worker computes and writes it.
MILLION_CELLS = (
    "/api/field?sensor_type=co2&resolution=0.001"
    "&bbox_min_x=0&bbox_min_y=0&bbox_max_x=1&bbox_max_y=1"
)


def open_files() -> set[str]:
    """The numbers of this process's file descriptors."""
    return {entry.name for entry in Path("/proc/self/fd").iterdir()}


def test_hundreds_of_simultaneous_connections_need_no_second_attempt() -> None:
    with listen("127.0.0.1", 0) as listener, ExitStack() as stack:
        clients = [stack.enter_context(socket.socket()) for _ in range(400)]
        poll = select.poll()
        for client in clients:
            client.setblocking(False)
            client.connect_ex(listener.getsockname())
            poll.register(client, select.POLLOUT)
        # Nothing accepts them: those beyond the kernel's queue get in no later either.
        wait_for(lambda: len(poll.poll(0)) == len(clients), "all to be let in")


def test_an_ipv6_address_has_brackets_and_one_in_use_is_refused_with_nothing_left_open() -> None:
    with listen("::1", 0) as listener:
        assert address_of(listener) == f"http://[::1]:{listener.getsockname()[1]}"
    with listen("127.0.0.1", 0) as listener:
        before = open_files()
        with pytest.raises(OSError, match="in use"):
            listen("127.0.0.1", listener.getsockname()[1])
        assert open_files() == before


@pytest.mark.parametrize(
    ("limits", "expected", "clients"),
    [
        ((1_024, 20_000), 5_512, 5_000),
        ((1_024, 5_511), 5_511, 4_999),
        ((8_000, 20_000), 8_000, 5_000),
        ((5_512, 5_512), 5_512, 5_000),
        ((256, 256), 256, 64),
        ((1_024, resource.RLIM_INFINITY), 5_512, 5_000),
        ((resource.RLIM_INFINITY, resource.RLIM_INFINITY), resource.RLIM_INFINITY, 5_000),
    ],
)
def test_it_raises_its_file_limit_for_the_clients_and_reports_where_it_cannot(
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    limits: tuple[int, int],
    expected: int,
    clients: int,
) -> None:
    _, hard = limits
    history = [limits]
    monkeypatch.setattr(resource, "getrlimit", lambda _: history[-1])
    monkeypatch.setattr(resource, "setrlimit", lambda _, both: history.append(both))
    assert allow_connections(5_000) == clients
    assert history[-1] == (expected, hard)
    message = f"--max-clients is 5000, but this process may open {hard} files"
    assert (message in caplog.text) == (clients < 5_000) == (f"serving {clients} " in caplog.text)


@contextmanager
def waiting_for(url: str, path: str) -> Iterator[Future[httpx.Response]]:
    """A client that sends a request and waits for its answer."""

    def query() -> httpx.Response:
        return httpx.get(f"{url}{path}", timeout=PATIENCE_S, trust_env=False)

    with ThreadPoolExecutor(1) as client:
        yield client.submit(query)


def assert_sent_away(answer: Future[httpx.Response]) -> None:
    """A client that waits at the shutdown is cut off, to try again."""
    assert isinstance(answer.exception(PATIENCE_S), httpx.TransportError)


def assert_quiet(process: Process) -> None:
    # Whether we cut off a client that does not read or, on a busy machine, uvicorn does, and
    # logs it as an error, does not matter.
    ours = [line for line in process.output.splitlines() if "graceful shutdown" not in line]
    for word in ("Traceback", "ERROR", "Exception"):
        assert word not in "\n".join(ours)


def last_words(listener: Listener) -> tuple[str, int]:
    """The reason in the last status frame, and the code of the close frame."""
    reason = ""
    try:
        while True:
            frame = listener.next()
            if frame["type"] == "status":
                reason = frame["reason"]
    except ConnectionClosed as closed:
        return reason, 0 if closed.rcvd is None else closed.rcvd.code


def test_a_signal_ends_it_and_all_clients_are_notified_whether_they_read_or_not() -> None:
    with (
        bridge() as running_bridge,
        running_bridge.listen() as one,
        running_bridge.listen() as two,
        deaf_client(running_bridge.url),
        deaf_client(running_bridge.url, MILLION_CELLS),
    ):
        assert one.connection.response is not None
        assert "sec-websocket-extensions" not in one.connection.response.headers, "uncompressed"
        two.until("state")
        overfill(running_bridge, one)
        running_bridge.get("/api/state")  # and its connection is kept alive
        running_bridge.process.send(signal.SIGINT)
        running_bridge.process.send(signal.SIGINT)
        assert running_bridge.process.wait() == 0
        assert last_words(one) == last_words(two) == ("shutting_down", 1012)
        assert_quiet(running_bridge.process)


# All of these hang: a worker that computes a field, one that writes it, and the ROS thread with an
# observation. Each hangs for its own sensor.
HANGS = tuple(
    f"{function}:{sensor}"
    for function, sensor in (
        ("lupin_bridge.past.fields:compute_field", "co2"),
        ("lupin_bridge.field:write", "light"),
        ("lupin_twin.core.ingest:apply", "humidity"),
    )
)


def test_fields_that_never_finish_do_not_delay_the_shutdown(domain: int) -> None:
    with (
        lupin_twin(domain, "serve", *faults("--hang", *HANGS)) as process,
        Peer(domain) as peer,
        listener(url_of(process)) as healthy,
        ExitStack() as stack,
    ):
        healthy.until("state")
        answers = []
        for sensor, what in (("co2", "compute_field"), ("light", "write")):
            requested = waiting_for(url_of(process), MILLION_CELLS.replace("co2", sensor))
            answers.append(stack.enter_context(requested))
            process.wait_for_output(f"{what} hangs")
        peer.observe(scan("1", {"humidity": 50.0}))
        process.wait_for_output("apply hangs")
        assert process.stop(signal.SIGINT) == 0
        for answer in answers:
            assert_sent_away(answer)
        assert last_words(healthy) == ("shutting_down", 1012)
        assert_quiet(process)


def test_after_a_signal_it_stops_whatever_hangs_within_the_documented_time() -> None:
    server = BridgeServer(FastAPI(), Settings(), [])
    server.handle_exit(signal.SIGINT, None)
    server.handle_exit(signal.SIGINT, None)
    left_s = signal.alarm(0)
    faulthandler.cancel_dump_traceback_later()
    assert server.should_exit
    assert not server.force_exit, "nothing is cancelled before its time"
    assert END_S <= left_s <= END_S + 1
    assert CLOSE_AFTER_S < GRACEFUL_SHUTDOWN_S
    assert GRACEFUL_SHUTDOWN_S + max(STOP_TIMEOUT_S, FEEDER_STOP_S) + IDLE_WORKERS_END_S <= 2.0


# 1,000,000 cells, 5 MB of JSON: more than two sockets buffer.
LARGE_FIELD = (
    "/api/field.json?sensor_type=co2&resolution=0.01"
    "&bbox_min_x=0&bbox_min_y=0&bbox_max_x=10&bbox_max_y=10"
)
SMALL_FIELD = LARGE_FIELD.replace("0.01", "10")
CONCURRENCY = 3
TIMEOUT_S = 3


@pytest.fixture(scope="module")
def live() -> Iterator[Served]:
    options = limits(client_timeout_s=TIMEOUT_S, concurrency=CONCURRENCY)
    with served(*options) as running:
        yield running


def test_a_large_field_arrives_whole(live: Served) -> None:
    with live.client() as client:  # on one connection: each answer has an end
        response, head = client.get(LARGE_FIELD), client.head(LARGE_FIELD)
    assert len(response.content) == int(response.headers["content-length"]) > 4_000_000
    assert len(response.json()["values"]) == 1_000_000
    assert (head.content, head.headers["content-length"]) == (
        b"",
        response.headers["content-length"],
    )
    assert "ERROR" not in live.process.output


def test_stuck_readers_hold_only_their_own_places_and_are_cut_off(live: Served) -> None:
    refused = f"has {CONCURRENCY} requests for computed answers in flight, the limit"
    with contextlib.ExitStack() as readers:
        # For one cached field, the number of readers is not limited, and all may be stuck.
        large = [LARGE_FIELD.replace("co2", f"co2_{number}") for number in range(CONCURRENCY)]
        deaf = [readers.enter_context(deaf_client(live.url, field)) for field in large]
        wait_for(lambda: refused in live.get(SMALL_FIELD).text, "the deaf readers' places")
        with live.client("127.0.4.1") as other:
            assert other.get(SMALL_FIELD).status_code == 200, "it is another client"
        line = f"disconnected a reader that accepted nothing for {TIMEOUT_S} s"
        wait_for(lambda: live.process.output.count(line) == CONCURRENCY, "their end")
        assert all(len(raw_http.received(client)) < 4_000_000 for client in deaf)
    wait_for(lambda: live.get(SMALL_FIELD).status_code == 200, "their places to be free")
    assert "ERROR" not in live.process.output


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "http.sock"


@contextmanager
def asking(path: Path, *options: str) -> Iterator[httpx.Client]:
    """Query a bridge that serves there, as its proxy does."""
    options = ("--host", f"unix:{path}", *options)
    with (
        own_domain() as domain,
        lupin_twin(domain, "serve", *options, "--ros-args", "-p", "journal:=off") as process,
    ):
        process.wait_for_output(f"lupin-twin: unix:{path}")
        transport = httpx.HTTPTransport(uds=str(path))
        with httpx.Client(
            base_url="http://localhost", transport=transport, timeout=PATIENCE_S
        ) as client:
            yield client
        assert not {"warning", "error"} & set(re.findall(r"\w+", process.output.lower()))


def test_owner_and_group_may_connect_and_a_state_arrives(path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as left:
        left.bind(str(path))  # and its process has ended
    with asking(path) as client:
        assert path.stat().st_mode & 0o777 == 0o660
        with socket.socket(socket.AF_UNIX) as named:
            named.bind(f"\0{path}")  # in Linux's abstract namespace: its name is bytes
            named.connect(str(path))
            named.sendall(b"GET /healthz HTTP/1.0\r\nHost: localhost\r\n\r\n")
            assert named.recv(15) == b"HTTP/1.1 200 OK"
        assert client.get("/api/state").status_code in (200, 503)
        with unix_connect(str(path), "ws://localhost/ws/state") as connection:
            assert '"status"' in str(connection.recv(timeout=PATIENCE_S))
        in_use = f"lupin-twin: cannot listen on unix:{path}: Address already in use"
        assert refused_start("--host", f"unix:{path}") == in_use


def test_its_client_is_the_proxy_and_names_the_person(path: Path, tmp_path: Path) -> None:
    add(tmp_path / "accounts.sqlite", anna="operator")
    accounts = ("--accounts", str(tmp_path / "accounts.sqlite"))
    with asking(path, *accounts, "--proxy-user-header", "Remote-User") as client:
        assert client.get("/api/session").status_code == 401
        assert client.get("/api/session", headers={"Remote-User": "anna"}).json()["name"] == "anna"


@pytest.mark.parametrize("name", ["file", "no-such-folder/http.sock", "long" * 40])
def test_a_path_that_is_no_socket_is_reported_and_no_file_lost(name: str, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("somebody's")
    line = refused_start("--host", f"unix:{tmp_path / name}")
    assert line.startswith(f"lupin-twin: cannot listen on unix:{tmp_path / name}: ")
    assert "None" not in line
    assert (tmp_path / "file").read_text() == "somebody's"


def test_no_thread_and_no_descriptor_is_left_behind(domain: int) -> None:
    def left() -> tuple[set[str], int]:
        threads = {thread.name for thread in threading.enumerate()}
        return threads, len(list(Path("/proc/self/fd").iterdir()))

    async def once() -> None:
        async with (
            running() as served,
            connect(
                ws_url(served.url), proxy=None, max_size=None, open_timeout=PATIENCE_S
            ) as listener,
        ):
            await listener.recv()
            assert (await served.http.get("/api/field.png?sensor_type=co2")).status_code == 200

    run(domain, once())  # what is made once per process stays
    threads, files = left()  # some of which may be about to end
    for _ in range(3):
        run(domain, once())

    def are_gone() -> bool:
        threads_now, files_now = left()
        return threads_now <= threads and files_now <= files

    wait_for(are_gone, "no more threads and descriptors than before")
