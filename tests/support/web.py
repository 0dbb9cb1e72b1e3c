"""The bridge from outside: a real `lupin-twin serve`, HTTP, WebSocket, and the robot's side."""

import json
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any
from urllib.parse import urlencode

import httpx
from websockets.sync.client import ClientConnection

from tests.support import raw_http
from tests.support.domains import own_domain
from tests.support.messages import inspection
from tests.support.processes import Process, lupin_twin, url_of
from tests.support.ros import Peer
from tests.support.structure import ROOT
from tests.support.waiting import PATIENCE_S, wait_for
from tests.support.ws_client import open_websocket

Frame = dict[str, Any]

# Every HTTP route for GET, from the copy of the OpenAPI document that is in git; and that itself. Two
# routes exist only where there are accounts.
_DOCUMENT = json.loads((ROOT / "frontend" / "openapi.json").read_text(encoding="utf-8"))
_READ = [path for path, it in _DOCUMENT["paths"].items() if "get" in it]
ROUTES = [path for path in (*_READ, "/openapi.json") if path not in ("/api/audit", "/api/push")]


def ws_url(url: str, **query: Any) -> str:
    """The address of the WebSocket at a bridge's address; keyword arguments are the query."""
    parameters = f"?{urlencode(query)}" if query else ""
    return url.replace("http", "ws", 1) + "/ws/state" + parameters


class Listener:
    """A WebSocket client that reads frames one by one."""

    def __init__(self, connection: ClientConnection) -> None:
        self.connection = connection

    def next(self, timeout_s: float = PATIENCE_S) -> Frame:
        message = self.connection.recv(timeout=timeout_s)
        frame: Frame = json.loads(message)
        return frame

    def rest(self) -> list[Frame]:
        """The frames that have arrived so far and were not read."""
        frames = []
        with suppress(TimeoutError):
            while True:
                frames.append(self.next(timeout_s=0.0))
        return frames

    def until(self, kind: str, accept: Callable[[Frame], bool] = lambda _: True) -> Frame:
        """Read on to the first frame of a type that `accept` takes, and return that."""

        def check() -> Frame | None:
            frame = self.next()
            return frame if frame["type"] == kind and accept(frame) else None

        found = wait_for(check, f"a {kind} frame as expected", meanwhile=lambda _: None)
        assert found is not None
        return found

    def until_text(self, text: str) -> None:
        """Read on past the first frame that contains a text; frames are not decoded."""
        wait_for(
            lambda: text in str(self.connection.recv(timeout=PATIENCE_S)),
            f"a frame with {text}",
            meanwhile=lambda _: None,
        )

    def until_tag(self, tag_id: str) -> Frame:
        """Read on to the first state frame that has the tag, and return that frame."""
        return self.until("state", lambda frame: tag_id in tag_ids(frame["state"]))


def tag_ids(state: dict[str, Any]) -> list[str]:
    """The tags of a state (`schema.TwinState` as JSON), in order."""
    return [tag["tag_id"] for tag in state["tags"]]


def filled(tag: dict[str, Any]) -> dict[str, Any]:
    """A tag (`schema.TwinTagState` as JSON) with its omitted fields."""
    usual, readings = tag["last_observed"], []
    for reading in tag["readings"]:
        usual = reading.get("observed_at", usual)
        readings.append({**reading, "observed_at": usual})
    attempted = {"last_try": tag["last_observed"], "last_try_status": 0, "last_try_detail": ""}
    return {"looked_at": None, **attempted, **tag, "readings": readings}


def without_ages(state: dict[str, Any]) -> list[dict[str, Any]]:
    """The tags of a state, without what changes by itself."""
    return [{**tag, "stale_seconds": 0} for tag in state["tags"]]


@contextmanager
def listener(url: str, **query: Any) -> Iterator[Listener]:
    """A WebSocket client of the bridge at `url`; keyword arguments are the query."""
    with open_websocket(ws_url(url, **query)) as connection:
        yield Listener(connection)


class Bridge:
    """A bridge in its own process, and its two sides: a ROS peer and an HTTP client."""

    def __init__(self, process: Process, url: str, peer: Peer, http: httpx.Client) -> None:
        self.process, self.url, self.peer, self.http = process, url, peer, http

    def get(self, path: str, headers: dict[str, str] | None = None, **query: Any) -> httpx.Response:
        """GET a path; keyword arguments are the query."""
        return self.http.get(path, headers=headers, params=query or None)

    def json(self, path: str, **query: Any) -> Any:
        """The JSON at a path, which has to exist."""
        response = self.get(path, **query)
        assert response.status_code == 200, response.text
        return response.json()

    def tag(self, tag_id: str, accept: Callable[[Any], bool] = lambda _: True) -> Any:
        """A tag as soon as the bridge has it and `accept` takes it."""

        def check() -> Any:
            tags = self.json("/api/state")["tags"]
            return next((t for t in tags if t["tag_id"] == tag_id and accept(t)), None)

        return wait_for(check, f"tag {tag_id} as expected at {self.url}")

    def listen(self, **query: Any) -> Any:
        """A `Listener`, in a `with`; keyword arguments are the query."""
        return listener(self.url, **query)


@contextmanager
def bridge(
    *options: str, domain: int | None = None, afresh: bool = False, **env: str
) -> Iterator[Bridge]:
    """`lupin-twin serve` with these options, in its own ROS domain unless one is given."""
    if domain is None:
        with own_domain() as own, bridge(*options, domain=own, afresh=afresh, **env) as running:
            yield running
        return
    with (
        lupin_twin(domain, "serve", *options, afresh=afresh, **env) as process,
        Peer(domain) as peer,
        httpx.Client(base_url=url_of(process), timeout=PATIENCE_S, trust_env=False) as http,
    ):
        yield Bridge(process, str(http.base_url).rstrip("/"), peer, http)


@contextmanager
def deaf_client(url: str, *paths: str) -> Iterator[socket.socket]:
    """A client that requests all of the paths at once, and reads nothing; its buffers are small.

    Without a path it is a WebSocket client that requests frames.
    """
    requested = [f"GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode() for path in paths]
    with raw_http.connect(url, room=4_096) as client:
        for request in requested or [raw_http.handshake("/ws/state")]:
            client.sendall(request)
        yield client


def overfill(running: Bridge, reader: Listener) -> None:
    """Let the twin send states until no socket can buffer those that a deaf client does not read.

    A socket takes 4 MB (Linux's tcp_wmem); these are eight states of 0.3 MB to 2.5 MB, 10 MB in
    all. Returns when `reader` has the last one.
    """
    message = inspection("", blooms=[(i, i) for i in range(2_000)])
    for number in range(8):
        message.flower.tag_id = f"fat {number}"
        running.peer.observe(message)
        reader.until_text(f'"tag_id":"fat {number}"')
