"""Behind a real nginx, with the configuration that we ship: replicas, a prefix, people by name."""

import signal
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import httpx
import pytest
from websockets.exceptions import ConnectionClosed, InvalidHandshake, InvalidStatus
from websockets.sync.client import connect

from tests.support.access import BEARER, TOKEN
from tests.support.docs import block_named
from tests.support.domains import own_domain
from tests.support.live import attached, field_of, wait_until_ready
from tests.support.messages import inspection, occupancy_grid, scan
from tests.support.nginx import CONFIGURATION, nginx
from tests.support.people import OWN, changing
from tests.support.processes import OFTEN, lupin_twin, twin_node
from tests.support.ros import Peer
from tests.support.rosbridge import Ros
from tests.support.waiting import PATIENCE_S, wait_for
from tests.support.web import Bridge, without_ages

# How long a client may be without news of the twin (docs/how-to/clients-javascript.md).
BACK_WITHIN_S = 3.5
CLIENTS = 12
PAUSE_S = 0.5


@dataclass
class Greenhouse:
    """A twin, three replicas, and nginx before them."""

    url: str
    replicas: list[Bridge]
    peer: Peer


@contextmanager
def running(folder: Path) -> Iterator[Greenhouse]:
    with ExitStack() as stack:
        domain = stack.enter_context(own_domain())
        stack.enter_context(twin_node(domain, *OFTEN))
        peer = stack.enter_context(Peer(domain))
        options = ("--path-prefix", "/gh1", "--trusted-proxy", "127.0.0.1")
        named = ("--allow-host", "twin.example")

        def replica() -> Bridge:
            process = lupin_twin(domain, "web", *options, *named, LUPIN_TOKEN=TOKEN)
            made = stack.enter_context(attached(stack.enter_context(process), peer))
            made.http.headers.update(BEARER)
            wait_until_ready(made)
            return made

        first = replica()
        # The others never receive the first of these maps, nor the first reading of "a".
        peer.publish_map(occupancy_grid([[0, 0], [0, 100]]))
        peer.observe(scan("a", {"co2": 400.0}, (0, 0)))
        first.tag("a")
        wait_for(lambda: first.get("/api/map").status_code == 200, "the map")
        peer.publish_map(occupancy_grid([[0, -1], [0, 100]]))
        peer.observe(
            scan("a", {"co2": 500.0}),
            scan("b", {"co2": 700.0, "humidity": float("nan")}, (1, 0)),
            inspection("a", "lupin", blooms=[(0.1, 0.1)], footprint=[(0, 0), (1, 0), (1, 1)]),
        )
        replicas = [first, replica(), replica()]
        for each in replicas:
            each.tag("b")
            each.tag("a", lambda tag: tag["flowers"])
        ports = [int(replica.url.rpartition(":")[2]) for replica in replicas]
        yield Greenhouse(stack.enter_context(nginx(folder, ports)), replicas, peer)


@pytest.fixture(scope="module")
def greenhouse(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Greenhouse]:
    with running(tmp_path_factory.mktemp("nginx")) as it:
        yield it


def test_the_page_and_all_its_requests_are_below_the_prefix(greenhouse: Greenhouse) -> None:
    with httpx.Client(base_url=greenhouse.url, trust_env=False, timeout=PATIENCE_S) as browser:
        page = {"Accept": "text/html", "Host": "twin.example"}
        # Redirected to the sign-in page, and in with its cookie.
        requested = browser.get("/gh1/", headers=page)
        assert (requested.status_code, requested.headers["location"]) == (303, "signin")
        assert browser.get("/gh1/signin", headers=page).status_code == 200
        signed_in = browser.post("/gh1/api/signin", headers={**BEARER, **OWN})
        (cookie,) = signed_in.headers.get_list("set-cookie")
        assert "Path=/gh1/" in cookie
        assert "Secure" not in cookie, "nginx serves http here, and says so"
        assert browser.get("/gh1", headers=page).headers["location"].endswith("/gh1/")
        # Every replica accepts the cookie; it is not sent outside the prefix.
        for _ in range(6):
            home = browser.get("/gh1/", headers=page)
            assert "Lupin twin" in home.text
        assert not browser.get("/", headers=page).is_success
        for name in (part.split('"')[0] for part in home.text.split('="./')[1:]):
            assert browser.get(f"/gh1/{name}").status_code == 200, name
        assert browser.get("/gh1/api/state").json()["tags"][0]["tag_id"] == "a"
        docs = browser.get("/gh1/docs").headers["location"]
        assert docs.endswith("/gh1/docs/guide/reference/http.html")
        assert browser.get("/gh1/openapi.json").json()["servers"] == [{"url": "/gh1"}]
        ours, theirs = {"Origin": greenhouse.url}, {"Origin": "http://evil.example"}
        assert browser.get("/gh1/api/state", headers=ours).status_code == 200
        assert browser.get("/gh1/api/state", headers=theirs).status_code == 403
        headers = {"Cookie": cookie.partition(";")[0], **ours}
    with connect(ws(greenhouse), additional_headers=headers, proxy=None) as socket:
        assert '"status"' in str(socket.recv(timeout=PATIENCE_S))
    rosbridge = f"{greenhouse.url.replace('http', 'ws', 1)}/gh1/rosbridge"
    with connect(rosbridge, additional_headers=headers, proxy=None) as socket:
        assert Ros(socket).call("/rosapi/topics")["result"]


def ws(greenhouse: Greenhouse) -> str:
    return greenhouse.url.replace("http", "ws", 1) + "/gh1/ws/state"


def test_limits_and_logs_go_by_the_client_and_not_by_nginx(greenhouse: Greenhouse) -> None:
    wrong = {"Authorization": "Bearer " + "x" * 32, "X-Forwarded-For": "203.0.113.9"}
    transport = httpx.HTTPTransport(local_address="127.0.0.9")
    with httpx.Client(
        base_url=greenhouse.url, trust_env=False, transport=transport, timeout=PATIENCE_S
    ) as stranger:
        wait_for(
            lambda: stranger.get("/gh1/api/state", headers=wrong).status_code == 429,
            "ten wrong tokens at a replica",
            meanwhile=lambda _: None,
        )
    message = "".join(replica.process.output for replica in greenhouse.replicas)
    assert "wrong token from 127.0.0.9" in message
    assert "203.0.113.9" not in message
    url = f"{greenhouse.url}/gh1/api/state"
    assert httpx.get(url, headers=BEARER, trust_env=False, timeout=PATIENCE_S).is_success


FIELD: dict[str, Any] = {"sensor_type": "co2", "resolution": 0.25}
WITH_ETAGS: tuple[tuple[str, dict[str, Any]], ...] = (
    *((f"/api/field.{suffix}", FIELD) for suffix in ("json", "npy", "png")),
    *(("/api/map", {}), ("/api/map.png", {})),
)


def test_replicas_give_the_same_answers_and_take_each_others_etags(greenhouse: Greenhouse) -> None:
    first, *others = greenhouse.replicas
    assert field_of(first, **FIELD).json()["sample_count"] == 2
    for other in others:
        field_of(other, **FIELD)
        # The latest map, and a state's times, come after the state.
        for path, query in WITH_ETAGS:

            def is_same() -> bool:
                ours = first.get(path, **query)  # noqa: B023
                etag = {"If-None-Match": ours.headers["etag"]}
                again = other.get(path, etag, **query)  # noqa: B023
                return again.status_code == 304 and ours.content == other.get(path, **query).content  # noqa: B023

            wait_for(is_same, f"the same {path}, and its ETag")

        def state(of: Bridge) -> Any:
            return without_ages(of.json("/api/state"))

        wait_for(lambda: state(first) == state(other), "the same state")  # noqa: B023


@dataclass
class Screen:
    """A client that follows the docs: back after half a second, later where that fails."""

    url: str
    gaps_s: list[float] = field(default_factory=list)
    returns: int = 0
    failures: int = 0
    is_over: bool = False
    last_frame_s: float = 0.0
    problem: Exception | None = None

    def run(self) -> None:
        try:
            while not self.is_over:
                try:
                    with connect(self.url, additional_headers=BEARER, proxy=None) as socket:
                        self._watch(socket)
                except (ConnectionClosed, InvalidHandshake, OSError):
                    self.returns += 1
                    self._pause()
        except Exception as error:  # noqa: BLE001  # told by the test
            self.problem = error

    def _pause(self) -> None:
        until_s = time.monotonic() + PAUSE_S * 2 ** min(self.failures, 5)
        wait_for(lambda: time.monotonic() > until_s or self.is_over, "the pause")
        self.failures += 1

    def _watch(self, socket: Any) -> None:
        while not self.is_over:
            socket.recv(timeout=PATIENCE_S)
            now_s = time.monotonic()
            self.failures = 0
            if self.last_frame_s:
                self.gaps_s.append(now_s - self.last_frame_s)
            self.last_frame_s = now_s


def longest_gap_s(
    greenhouse: Greenhouse, screens: list[Screen], replica: Bridge, number: int
) -> float:
    """How long a client was without a frame, at most, since a replica was stopped."""
    returns = sum(screen.returns for screen in screens)
    before = [len(screen.gaps_s) for screen in screens]
    replica.process.send(signal.Signals(number))
    wait_for(lambda: sum(screen.returns for screen in screens) > returns, "clients cut off")
    greenhouse.peer.observe(scan("after", {"co2": 1.0}, (2, 0)))
    replica.process.wait()
    deadline = time.monotonic() + BACK_WITHIN_S
    wait_for(
        lambda: (
            time.monotonic() > deadline
            and all(screen.last_frame_s > deadline for screen in screens)
        ),
        "all clients to go on",
    )
    pairs = zip(before, screens, strict=True)
    worst_s = max(gap for count, screen in pairs for gap in screen.gaps_s[count:])
    print(f"longest without a frame: {worst_s:.2f} s")
    return worst_s


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_clients_of_a_replica_that_stops_under_load_are_back_in_time(
    tmp_path: Path, number: signal.Signals
) -> None:
    with running(tmp_path) as greenhouse:
        screens = [Screen(ws(greenhouse)) for _ in range(CLIENTS)]
        threads = [threading.Thread(target=screen.run) for screen in screens]
        load = Load(f"{greenhouse.url}/gh1/api/field?sensor_type=co2&resolution=0.02")
        threads.append(threading.Thread(target=load.run))
        for thread in threads:
            thread.start()
        try:
            wait_for(lambda: all(screen.gaps_s for screen in screens), "frames at all clients")
            wait_for(lambda: load.answers > 10, "answers under load")
            before = load.answers
            # A busy machine may be late once.
            assert any(
                longest_gap_s(greenhouse, screens, replica, number) < BACK_WITHIN_S
                for replica in greenhouse.replicas[:2]
            )
            wait_for(lambda: load.answers > before + 10, "answers from the others")
        finally:
            load.is_over = True
            for screen in screens:
                screen.is_over = True
            for thread in threads:
                thread.join()
        assert [screen.problem for screen in screens] == [None] * CLIENTS
        assert load.refused == [], "nginx tries another replica"


@dataclass
class Load:
    url: str
    answers: int = 0
    refused: list[int] = field(default_factory=list)
    is_over: bool = False

    def run(self) -> None:
        with httpx.Client(trust_env=False, headers=BEARER, timeout=PATIENCE_S) as client:
            while not self.is_over:
                try:
                    status = client.get(self.url).status_code
                except (httpx.RemoteProtocolError, httpx.ReadError):
                    continue  # in the middle of its answer: nginx cannot repeat that
                # 429: the limit for one client; 503: a replica that is being stopped.
                if status not in (200, 429, 503):
                    self.refused.append(status)
                self.answers += 1


COOKIE = {"Cookie": "sso=of-anna"}
NOTE = {"kind": "comment", "subject": "site", "text": "by the proxy"}


class SignInService(BaseHTTPRequestHandler):
    """Knows one cookie; a request with a body does not come from nginx."""

    def do_GET(self) -> None:
        """200 with the name, or 401."""
        is_known = self.headers.get("Cookie") == COOKIE["Cookie"]
        assert self.headers.get("Content-Length") is None
        self.send_response(200 if is_known else 401)
        if is_known:
            self.send_header("Remote-User", "anna@example.org")
        self.send_header("Content-Length", "0")
        self.end_headers()

    def log_message(self, *_: object) -> None:
        """Nothing."""


@contextmanager
def sign_in_service() -> Iterator[int]:
    with ThreadingHTTPServer(("127.0.0.1", 0), SignInService) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield server.server_port
        server.shutdown()
        thread.join()


@pytest.fixture
def url(tmp_path: Path) -> Iterator[str]:
    """Of nginx, with a bridge behind it where anna is an operator without a password."""
    path = tmp_path / "accounts.sqlite"
    with changing(path) as accounts:
        accounts.add("anna@example.org", "account", "operator", "", by="a test", now_s=1)
    inner = tmp_path / "http.sock"
    options = ("--host", f"unix:{inner}", "--path-prefix", "/gh1", "--accounts", str(path))
    named = ("--proxy-user-header", "Remote-User", "--ros-args", "-p", "journal:=off")
    with (
        own_domain() as domain,
        lupin_twin(domain, "serve", *options, *named) as running,
        sign_in_service() as port,
    ):
        running.wait_for_output(f"lupin-twin: unix:{inner}")
        block = block_named("auth-request").text.replace(":9091", f":{port}")
        shipped = CONFIGURATION.read_text(encoding="utf-8")
        assert shipped.count("location /gh1/ {") == 1
        text = shipped.replace("location /gh1/ {", block)
        with nginx(tmp_path, [inner] * 3, text) as address:
            yield f"{address}/gh1"


def test_only_people_whom_the_service_knows_are_in_by_name(url: str) -> None:
    with httpx.Client(trust_env=False, timeout=PATIENCE_S) as client:

        def write(headers: dict[str, str]) -> httpx.Response:
            return client.post(f"{url}/api/notes", json=NOTE, headers={**OWN, **headers})

        claimed = {"Remote-User": "anna@example.org"}
        for headers in ({}, claimed, {"Cookie": "sso=made-up"}):
            assert client.get(f"{url}/api/session", headers=headers).status_code == 401
        assert write(claimed).status_code == 401
        session = client.get(f"{url}/api/session", headers={**COOKIE, "Remote-User": "boss"}).json()
        assert (session["name"], session["role"]) == ("anna@example.org", "operator")
        wait_for(lambda: write(COOKIE).status_code == 201, "a note", meanwhile=lambda _: None)
        assert write({**COOKIE, "Origin": "http://evil.example"}).status_code == 403
        noted = client.get(f"{url}/api/notes", headers=COOKIE).json()["notes"]
        assert {note["by"] for note in noted} == {"anna@example.org"}
    socket = f"{url.replace('http', 'ws', 1)}/ws/state"
    with connect(socket, additional_headers=COOKIE, proxy=None) as connection:
        assert '"status"' in str(connection.recv(timeout=PATIENCE_S))
    with pytest.raises(InvalidStatus, match="401"), connect(socket, proxy=None):
        pass
