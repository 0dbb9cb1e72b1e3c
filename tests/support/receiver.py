"""A real HTTP server that accepts a webhook's posts, and answers as a test needs."""

import json
import socket
import ssl
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from tests.support.waiting import PATIENCE_S

# The answer to a request: bytes, and None: nothing more until the test ends.
Answer = Callable[["Posted"], Iterator[bytes | None]]


@dataclass(frozen=True)
class Posted:
    """One request as it came."""

    path: str
    headers: Mapping[str, str]
    body: bytes

    @property
    def json(self) -> Any:
        return json.loads(self.body)


def status(code: int, *headers: str) -> Answer:
    """This status, no body."""
    lines = "".join(f"{line}\r\n" for line in (*headers, "Content-Length: 0"))
    return lambda _: iter([f"HTTP/1.1 {code} Said\r\n{lines}\r\n".encode()])


def silence(_: Posted) -> Iterator[bytes | None]:
    """No answer at all."""
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

    def serve(self, client: socket.socket) -> None:
        with client:
            client.settimeout(PATIENCE_S)
            posted = _read(client)
            if posted is None:
                return
            answer = self.answers.pop(0) if len(self.answers) > 1 else self.answers[0]
            self.posted.append(posted)
            try:
                for piece in answer(posted):
                    if piece is None:
                        self.is_over.wait(PATIENCE_S)
                        return
                    client.sendall(piece)
            except OSError:
                return  # it stopped before the end


def _read(client: socket.socket) -> Posted | None:
    got = b""
    try:
        while b"\r\n\r\n" not in got:
            piece = client.recv(65_536)
            if not piece:
                return None
            got += piece
        head, _, body = got.partition(b"\r\n\r\n")
        first, *lines = head.decode("ascii").split("\r\n")
        headers = dict(line.lower().split(": ", 1) for line in lines if ": " in line)
        exact = dict(line.split(": ", 1) for line in lines)
        while len(body) < int(headers["content-length"]):
            body += client.recv(65_536)
    except OSError:
        return None
    named = {name.lower(): value for name, value in exact.items()}
    return Posted(first.split(" ")[1], named, body)


@contextmanager
def receiver(
    *answers: Answer, port: int = 0, tls: ssl.SSLContext | None = None
) -> Iterator[Receiver]:
    """A server on a port of loopback that answers each POST with the next of these."""
    with socket.create_server(("127.0.0.1", port), reuse_port=False) as listener:
        running = Receiver(listener.getsockname()[1], list(answers))
        threads: list[threading.Thread] = []

        def accept() -> None:
            while True:
                try:
                    client, _ = listener.accept()
                    if running.is_over.is_set():
                        client.close()
                        return
                    if tls is not None:
                        client = tls.wrap_socket(client, server_side=True)
                except OSError:  # a failed TLS handshake, or a closed connection
                    if running.is_over.is_set():
                        return
                    continue
                thread = threading.Thread(target=running.serve, args=(client,))
                threads.append(thread)
                thread.start()

        accepting = threading.Thread(target=accept)
        accepting.start()
        try:
            yield running
        finally:
            running.is_over.set()
            with socket.create_connection(("127.0.0.1", running.port)):
                accepting.join()
            for thread in threads:
                thread.join()
