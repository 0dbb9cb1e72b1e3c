"""Fan-out of state frames: one frame for all, and for a slow client only ever the newest.

The policy for slow clients, in full: a frame is written to a client whose socket has taken all of
the one before. To any other client nothing is written and nothing queued; when its socket is free
again it gets the newest frame there is, and sees from `seq` what it skipped. A client that cannot
take a frame for `client_timeout_s` is closed.

No input or output here and no clock: connections and times are arguments.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from lupin_bridge.frames import StateFrame

# RFC 6455, section 7.4.1, and the IANA registry: 1008 policy violation, 1013 try again later.
CLOSE_TOO_SLOW = 1008
CLOSE_TRY_AGAIN_LATER = 1013


class Writable(Protocol):
    """What the hub needs of a connection; `ws_protocol.Connection` is one."""

    @property
    def can_take(self) -> bool:
        """Whether everything written so far has gone out."""

    def write(self, wire: bytes) -> None:
        """Write without waiting."""

    def dismiss(self, code: int, reason: str) -> None:
        """Close with a reason, whether or not the other side reads."""


@dataclass(slots=True, eq=False)
class Client:
    """One listener: what it has got, and since when it owes us room in its socket."""

    connection: Writable
    sent_seq: int = 0
    status_due: bool = False
    blocked_since_s: float | None = None


class Hub:
    """Every client and the newest frame. Belongs to the event loop."""

    def __init__(self, max_clients: int, client_timeout_s: float) -> None:
        self._max_clients = max_clients
        self._client_timeout_s = client_timeout_s
        self._clients: set[Client] = set()
        self._frame: StateFrame | None = None
        self._status: bytes | None = None

    def __len__(self) -> int:
        return len(self._clients)

    @property
    def is_full(self) -> bool:
        """Whether one more client would be one too many."""
        return len(self._clients) >= self._max_clients

    def join(self, connection: Writable, now_s: float) -> Client:
        """Add a client and give it the status and the current state at once, in that order."""
        client = Client(connection, status_due=True)
        self._clients.add(client)
        self.serve(client, now_s)
        return client

    def leave(self, client: Client) -> None:
        """Forget a client; harmless if it has left already."""
        self._clients.discard(client)

    def publish(self, frame: StateFrame, now_s: float) -> None:
        """Make this the newest frame and give it to everyone who can take it."""
        self._frame = frame
        self._serve_all(now_s)

    def announce(self, status: bytes, now_s: float) -> None:
        """Make this the status (a WebSocket frame) and give it to everyone who can take it."""
        self._status = status
        for client in self._clients:
            client.status_due = True
        self._serve_all(now_s)

    def serve(self, client: Client, now_s: float) -> None:
        """Give a client what it lacks, as far as its socket takes it."""
        if client.status_due and self._status is not None:
            if not self._write(client, self._status, now_s):
                return
            client.status_due = False
        frame = self._frame
        if (
            frame is not None
            and frame.seq != client.sent_seq
            and self._write(client, frame.wire, now_s)
        ):
            client.sent_seq = frame.seq

    def dismiss_stuck(self, now_s: float) -> int:
        """Close every client that has not taken a frame for too long; returns how many."""
        stuck = [
            client
            for client in self._clients
            if client.blocked_since_s is not None
            and now_s - client.blocked_since_s >= self._client_timeout_s
        ]
        for client in stuck:
            self.leave(client)
            client.connection.dismiss(
                CLOSE_TOO_SLOW, f"took no frame for {self._client_timeout_s:g} s"
            )
        return len(stuck)

    def _serve_all(self, now_s: float) -> None:
        for client in self._clients:
            self.serve(client, now_s)

    def _write(self, client: Client, wire: bytes, now_s: float) -> bool:
        if not client.connection.can_take:
            if client.blocked_since_s is None:
                client.blocked_since_s = now_s
            return False
        client.blocked_since_s = None
        client.connection.write(wire)
        return True
