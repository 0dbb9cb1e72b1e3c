"""A bridge without a robot, and the different clients that query it."""

import ssl
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import httpx
from websockets.exceptions import InvalidStatus

from tests.support.domains import own_domain
from tests.support.people import OWN
from tests.support.processes import Process, lupin_twin, url_of
from tests.support.waiting import PATIENCE_S
from tests.support.wss import wss

TOKEN = "a-good-token/of.32~characters+==="
BEARER = {"Authorization": f"Bearer {TOKEN}"}


@dataclass(frozen=True)
class Served:
    process: Process
    url: str
    trust: ssl.SSLContext | bool = False

    def client(self, address: str | None = None, **options: Any) -> httpx.Client:
        """An HTTP client; `address` is the loopback address that it comes from."""
        transport = httpx.HTTPTransport(local_address=address, verify=self.trust)
        return httpx.Client(
            base_url=self.url, transport=transport, timeout=PATIENCE_S, trust_env=False, **options
        )

    def get(
        self, path: str, headers: dict[str, str] | None = None, method: str = "GET"
    ) -> httpx.Response:
        """One request on a connection of its own."""
        with self.client() as client:
            return client.request(method, path, headers=headers)

    def post(self, path: str, headers: dict[str, str] | None = None) -> httpx.Response:
        """A POST as the bridge's own pages make it."""
        return self.get(path, {**OWN, **(headers or {})}, "POST")

    def handshake(self, path: str = "/ws/state", headers: dict[str, str] | None = None) -> int:
        """The status of a WebSocket handshake; 101 once a first frame has arrived."""
        url = self.url.replace("http", "ws", 1) + path
        context = self.trust if isinstance(self.trust, ssl.SSLContext) else None
        try:
            with wss(url, context, headers) as connection:
                connection.recv()
                return 101
        except InvalidStatus as refused:
            return refused.response.status_code


@contextmanager
def served(
    *options: str, trust: ssl.SSLContext | bool = False, afresh: bool = False, **env: str
) -> Iterator[Served]:
    """`lupin-twin serve` with these options and environment, in a ROS domain of its own.

    It has no journal, and so needs no past process.
    """
    options = (*options, "--ros-args", "-p", "journal:=off")
    with (
        own_domain() as domain,
        lupin_twin(domain, "serve", *options, afresh=afresh, **env) as process,
    ):
        yield Served(process, url_of(process), trust)


def refused_start(*options: str, **env: str) -> str:
    """The one line with which `lupin-twin serve` ends instead of starting."""
    with (
        own_domain() as domain,
        lupin_twin(domain, "serve", *options, afresh=False, **env) as process,
    ):
        assert process.wait() == 2
        (line,) = process.output.splitlines()
        return line
