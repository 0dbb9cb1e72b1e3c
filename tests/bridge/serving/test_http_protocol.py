"""Answers go out as their readers take them: in pieces, and not at all to who takes nothing."""

import asyncio
import contextlib
import socket
from collections.abc import Iterator
from typing import Any

import pytest

from lupin_bridge.serving.http_protocol import PIECE_BYTES, PieceByPiece
from tests.support.access import Served, served
from tests.support.processes import limits
from tests.support.waiting import PATIENCE_S, wait_for

# 1,000,000 cells, 5 MB of JSON: more than two sockets hold between them.
LARGE_FIELD = (
    "/api/field.json?sensor_type=co2&resolution=0.01"
    "&bbox_min_x=0&bbox_min_y=0&bbox_max_x=10&bbox_max_y=10"
)
SMALL_FIELD = LARGE_FIELD.replace("0.01", "10")
CONCURRENCY = 3
TIMEOUT_S = 3


# --- in pieces ----------------------------------------------------------------------------------


class Reader:
    """Takes whatever is sent."""

    def __init__(self) -> None:
        self.messages: list[dict[str, Any]] = []

    async def send(self, message: Any) -> None:
        self.messages.append(message)

    @property
    def body(self) -> bytes:
        return b"".join(message.get("body", b"") for message in self.messages)


def answer(reader: Reader, *bodies: bytes) -> None:
    """Send an answer of these bodies to a reader."""

    async def app(_scope: Any, _receive: Any, send: Any) -> None:
        await send({"type": "http.response.start", "status": 200, "headers": []})
        for number, body in enumerate(bodies):
            more = number + 1 < len(bodies)
            await send({"type": "http.response.body", "body": body, "more_body": more})

    async def receive() -> Any:
        raise AssertionError("nobody asked")

    asyncio.run(PieceByPiece(app)({"type": "http"}, receive, reader.send))


def test_a_large_body_goes_out_in_pieces_that_add_up_to_it() -> None:
    body = bytes(range(256)) * (10 * PIECE_BYTES // 256) + b"the rest"
    reader = Reader()
    answer(reader, body)
    assert reader.body == body
    assert max(len(message.get("body", b"")) for message in reader.messages) == PIECE_BYTES
    more = [message["more_body"] for message in reader.messages[1:]]
    assert more == [True] * 11 + [False], "one end, and it is last"


@pytest.mark.parametrize("body", [b"", b"x", b"x" * PIECE_BYTES])
def test_a_small_body_goes_out_whole(body: bytes) -> None:
    reader = Reader()
    answer(reader, body)
    assert [message.get("body") for message in reader.messages] == [None, body]


def test_a_streamed_body_goes_on_after_a_large_part() -> None:
    large = b"x" * (PIECE_BYTES + 1)
    reader = Reader()
    answer(reader, b"head", large, b"tail")
    assert reader.body == b"head" + large + b"tail"
    assert [message["more_body"] for message in reader.messages[1:]].count(False) == 1


# --- served -------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def live() -> Iterator[Served]:
    options = limits(client_timeout_s=TIMEOUT_S, concurrency=CONCURRENCY)
    with served(*options) as running:
        yield running


@contextlib.contextmanager
def deaf_reader(live: Served, path: str) -> Iterator[socket.socket]:
    """A client that asks and reads nothing, with little room for the answer."""
    host, port = live.url.removeprefix("http://").split(":")
    with socket.socket() as client:
        client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        client.settimeout(PATIENCE_S)
        client.connect((host, int(port)))
        client.sendall(f"GET {path} HTTP/1.1\r\nHost: {host}\r\n\r\n".encode())
        yield client


def rest_of(client: socket.socket) -> int:
    """How many bytes still come before the connection ends."""
    size = 0
    with contextlib.suppress(ConnectionResetError):
        while piece := client.recv(65_536):
            size += len(piece)
    return size


def test_a_large_field_arrives_whole(live: Served) -> None:
    response = live.get(LARGE_FIELD)
    assert len(response.content) == int(response.headers["content-length"]) > 4_000_000
    assert len(response.json()["values"]) == 1_000_000
    head = live.get(LARGE_FIELD, method="HEAD")
    assert (head.content, head.headers["content-length"]) == (
        b"",
        response.headers["content-length"],
    )


def test_deaf_readers_keep_their_own_places_and_are_cut_off(live: Served) -> None:
    refused = f"has {CONCURRENCY} requests for computed answers in flight, the limit"
    with contextlib.ExitStack() as readers:
        # Of one kept field, as many readers as there are might be deaf.
        large = [LARGE_FIELD.replace("co2", f"co2_{number}") for number in range(CONCURRENCY)]
        deaf = [readers.enter_context(deaf_reader(live, field)) for field in large]
        wait_for(lambda: refused in live.get(SMALL_FIELD).text, "the deaf readers' places")
        with live.client("127.0.4.1") as other:
            assert other.get(SMALL_FIELD).status_code == 200, "it is another client"
        line = f"cut off a reader that took nothing for {TIMEOUT_S} s"
        wait_for(lambda: live.process.output.count(line) == CONCURRENCY, "their end")
        assert all(rest_of(client) < 4_000_000 for client in deaf)
    wait_for(lambda: live.get(SMALL_FIELD).status_code == 200, "their places to be free")
    assert "ERROR" not in live.process.output
