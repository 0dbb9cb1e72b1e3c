"""A real HTTP server that accepts a webhook's posts, and answers as a test needs."""

import json
import ssl
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

from tests.support.waiting import PATIENCE_S

# The answer to a request: bytes, and None: nothing more until the test ends.
Answer = Callable[["Posted"], Iterator[bytes | None]]


@dataclass(frozen=True)
class Posted:
    path: str
    headers: Mapping[str, str]
    body: bytes

    @property
    def json(self) -> Any:
        return json.loads(self.body)


def status(code: int, *headers: str) -> Answer:
    lines = "".join(f"{line}\r\n" for line in (*headers, "Content-Length: 0"))
    return lambda _: iter([f"HTTP/1.1 {code} Said\r\n{lines}\r\n".encode()])


def silence(_: Posted) -> Iterator[bytes | None]:
    yield None


@dataclass
class Receiver:
    """The received posts, and the answers to come; the last of `answers` is repeated."""

    port: int
    answers: list[Answer]
    posted: list[Posted] = field(default_factory=list)
    is_over: threading.Event = field(default_factory=threading.Event)

    @property
    def ids(self) -> list[str]:
        return [it.headers["webhook-id"] for it in self.posted]


class _Server(ThreadingHTTPServer):
    daemon_threads = False  # its end waits for them
    running: Receiver

    def handle_error(self, *_: object) -> None:
        """Nothing: a client that ends before the answer does."""


class _Handler(BaseHTTPRequestHandler):
    timeout = PATIENCE_S
    server: _Server

    def do_POST(self) -> None:
        """One answer, by hand: its bytes need not be HTTP."""
        running = self.server.running
        headers = {name.lower(): value for name, value in self.headers.items()}
        posted = Posted(self.path, headers, self.rfile.read(int(headers["content-length"])))
        answer = running.answers.pop(0) if len(running.answers) > 1 else running.answers[0]
        running.posted.append(posted)
        for piece in answer(posted):
            if piece is None:
                running.is_over.wait(PATIENCE_S)
                return
            self.wfile.write(piece)


@contextmanager
def receiver(
    *answers: Answer, port: int = 0, tls: ssl.SSLContext | None = None
) -> Iterator[Receiver]:
    """A server on a port of loopback that answers each POST with the next of these."""
    with _Server(("127.0.0.1", port), _Handler) as server:
        if tls is not None:
            server.socket = tls.wrap_socket(server.socket, server_side=True)
        server.running = running = Receiver(server.server_port, list(answers))
        thread = threading.Thread(target=server.serve_forever, args=(0.02,))
        thread.start()
        try:
            yield running
        finally:
            running.is_over.set()
            server.shutdown()
            thread.join()
