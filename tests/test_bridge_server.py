"""The server: its socket, its limits, and its end, with clients connected."""

from __future__ import annotations

import resource
import signal
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path

import httpx
import pytest
from websockets.exceptions import ConnectionClosed

from lupin_bridge.server import MAX_INBOUND_BYTES, address_of, allow_connections, listen
from tests.support.inprocess import run, running
from tests.support.waiting import wait_for
from tests.support.web import Bridge, Listener, bridge, deaf_client, overfill

MILLION_CELLS = (
    "/api/field?sensor_type=co2&resolution=0.001"
    "&bbox_min_x=0&bbox_min_y=0&bbox_max_x=1&bbox_max_y=1"
)


@pytest.fixture(scope="module")
def live() -> Iterator[Bridge]:
    with bridge() as running_bridge:
        yield running_bridge


def open_files() -> set[str]:
    """The numbers of this process's descriptors."""
    return {entry.name for entry in Path("/proc/self/fd").iterdir()}


# --- the socket ---------------------------------------------------------------------------------


def test_who_connects_before_the_server_serves_has_only_to_wait() -> None:
    with listen("127.0.0.1", 0) as listener:
        with socket.create_connection(listener.getsockname()) as client:
            assert client.getpeername() == listener.getsockname()
        assert address_of(listener) == f"http://127.0.0.1:{listener.getsockname()[1]}"


def test_ipv6_has_brackets_in_its_address() -> None:
    with listen("::1", 0) as listener:
        assert address_of(listener) == f"http://[::1]:{listener.getsockname()[1]}"


@pytest.mark.parametrize(
    ("soft", "hard", "expected"),
    [
        (1_024, 20_000, 5_512),
        (8_000, 20_000, 8_000),
        (1_024, 4_096, 4_096),
        (1_024, resource.RLIM_INFINITY, 5_512),
        (resource.RLIM_INFINITY, resource.RLIM_INFINITY, resource.RLIM_INFINITY),
    ],
)
def test_it_may_open_as_many_files_as_clients_need_and_says_where_it_may_not(
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    soft: int,
    hard: int,
    expected: int,
) -> None:
    limits = [(soft, hard)]
    monkeypatch.setattr(resource, "getrlimit", lambda _: limits[-1])
    monkeypatch.setattr(resource, "setrlimit", lambda _, both: limits.append(both))
    allow_connections(5_000)
    assert limits[-1] == (expected, hard)
    names_all = "--max-clients is 5000, but this process may open 4096 files" in caplog.text
    assert names_all == (hard == 4_096)


def test_an_address_in_use_is_refused_and_nothing_stays_open() -> None:
    with listen("127.0.0.1", 0) as listener:
        before = open_files()
        with pytest.raises(OSError, match="in use"):
            listen("127.0.0.1", listener.getsockname()[1])
        assert open_files() == before


def test_a_small_write_leaves_at_once(domain: int) -> None:
    async def test() -> None:
        async with running() as served:
            await served.http.get("/healthz")
            (connection,) = served.server.server_state.connections
            assert connection.transport is not None
            client = connection.transport.get_extra_info("socket")
            assert client.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY) == 1

    run(domain, test())


@contextmanager
def asked_heavily(running_bridge: Bridge) -> Iterator[None]:
    """One million-cell field after the other is asked for, until the server is gone."""
    answered = threading.Event()

    def ask() -> None:
        # Answered, cut off or turned away: that is for the moment of the end to decide.
        with suppress(httpx.TransportError):
            for number in count(1):
                running_bridge.get(f"{MILLION_CELLS}&power={1 + number / 100}")
                answered.set()

    client = threading.Thread(target=ask)
    client.start()
    try:
        wait_for(answered.is_set, "a first million-cell field")
        yield
    finally:
        running_bridge.process.kill()
        client.join()


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


# --- limits -------------------------------------------------------------------------------------


def test_what_a_client_says_is_read_and_thrown_away(live: Bridge) -> None:
    with live.listen() as listener:
        for _ in range(50):
            listener.connection.send("x" * 10_000)
            listener.connection.send(b"\x00\xff")
        listener.until("state", lambda frame: frame["seq"] > 1)


def test_a_message_past_the_limit_ends_that_client_alone(live: Bridge) -> None:
    with live.listen() as healthy, live.listen() as loud:
        loud.connection.send("x" * (MAX_INBOUND_BYTES + 1))
        assert last_words(loud)[1] == 1009
        newest = healthy.until("state")["seq"]
        healthy.until("state", lambda frame: frame["seq"] > newest)


def test_frames_are_not_compressed(live: Bridge) -> None:
    with live.listen() as listener:
        assert listener.connection.response is not None
        assert "sec-websocket-extensions" not in listener.connection.response.headers


def test_what_a_header_claims_of_a_proxy_is_not_believed(live: Bridge) -> None:
    page = live.get("/docs", headers={"X-Forwarded-Proto": "https", "X-Forwarded-For": "1.2.3.4"})
    assert f"curl '{live.url}/api/state'" in page.text


# --- the end ------------------------------------------------------------------------------------


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_and_every_client_is_told(
    number: signal.Signals,
) -> None:
    with bridge() as running_bridge, running_bridge.listen() as one, running_bridge.listen() as two:
        one.until("state")
        running_bridge.get("/api/state")  # and its connection is kept alive
        assert running_bridge.process.stop(number) == 0
        assert last_words(one) == last_words(two) == ("shutting_down", 1012)
        assert "Traceback" not in running_bridge.process.output
        assert "ERROR" not in running_bridge.process.output


def test_a_second_signal_does_no_harm() -> None:
    with bridge() as running_bridge, running_bridge.listen() as listener:
        listener.until("state")
        running_bridge.process.send(signal.SIGTERM)
        running_bridge.process.send(signal.SIGTERM)
        assert running_bridge.process.wait() == 0
        assert "Traceback" not in running_bridge.process.output


def test_neither_a_client_that_does_not_read_nor_a_heavy_request_holds_up_the_end() -> None:
    with (
        bridge() as running_bridge,
        running_bridge.listen() as healthy,
        deaf_client(running_bridge.url),
    ):
        overfill(running_bridge, healthy)
        with asked_heavily(running_bridge):
            assert running_bridge.process.stop(signal.SIGTERM) == 0
        assert last_words(healthy) == ("shutting_down", 1012)
        assert "Traceback" not in running_bridge.process.output
        assert "ERROR" not in running_bridge.process.output
