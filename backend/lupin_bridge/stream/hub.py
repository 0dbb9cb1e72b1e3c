"""Fan-out of state frames: all clients share one frame, and a slow client gets only the newest.

The full policy for slow clients: a frame is written only to a client whose socket has taken all of
the previous one. For any other client, nothing is written or queued. When its socket is free again,
it gets the newest frame, and sees from `seq` what it skipped. A client that cannot take a frame for
`Limits.client_timeout_s` is closed.

No I/O and no clock here: connections and times (s of a monotonic clock) are arguments.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from typing import Final, Literal, Protocol, get_args

import orjson

from lupin_bridge.stream.frames import StateFrame, Status, text_frame

# Large messages that wait for sockets, of all clients together. Pure; belongs to one thread.
#
# A message that many clients share counts once. So the total is mostly superseded messages, which
# only slow readers keep alive. Past the bound, the client that has waited longest is closed: its
# message is the oldest.


MAX_BYTES: Final = 256_000_000


class Unsent:
    """Which client holds which messages; `bytes` is the size of them all."""

    def __init__(self, max_bytes: int = MAX_BYTES) -> None:
        self.bytes = 0
        self.max_bytes = max_bytes
        # In the order in which they began to wait; for each its messages, by `id`.
        self._holders: dict[Client, dict[int, bytes]] = {}
        self._shares: Counter[int] = Counter()

    def hold(self, holder: Client, message: bytes) -> list[Client]:
        """Count a message that a client waits for; returns the clients to close, uncounted."""
        held = self._holders.setdefault(holder, {})
        key = id(message)
        if key not in held:
            held[key] = message
            self._shares[key] += 1
            if self._shares[key] == 1:
                self.bytes += len(message)
        gone = []
        while self.bytes > self.max_bytes:
            longest = next(iter(self._holders))
            self.let_go(longest)
            gone.append(longest)
        return gone

    def let_go(self, holder: Client) -> None:
        """Forget a client that waits no more; harmless if it is unknown."""
        for key, message in self._holders.pop(holder, {}).items():
            self._shares[key] -= 1
            if not self._shares[key]:
                del self._shares[key]
                self.bytes -= len(message)


# RFC 6455, section 7.4.1, and the IANA registry: 1008 policy violation, 1013 try again later.
CLOSE_POLICY: Final = 1008
CLOSE_TRY_AGAIN_LATER: Final = 1013


# Smaller messages that wait for sockets are not counted.
LARGE_BYTES: Final = 131_072

# A client that was sent nothing for this long gets the status again: a silent twin sends no states,
# and a browser that receives nothing for seconds considers the connection dead.
REMINDED_AFTER_S: Final = 1.0

# Lateness of a frame that does not delay the next one, as a share of the interval.
BEAT_SLACK: Final = 0.1


def next_beat_s(due_s: float, now_s: float, interval_s: float) -> float:
    """When the next frame is due, after one sent at `now_s` that was due at `due_s`.

    The schedule is fixed, not relative to the last frame. Otherwise, if the source has the same
    rate, a client would miss the frame after each late one. After a pause, the schedule starts
    anew, without catching up.
    """
    return max(due_s, now_s - BEAT_SLACK * interval_s) + interval_s


# What a client may get, in this order. The robot and the alarms follow a state, so that the client
# knows the alarms' tags, and the time for ages.
Kind = Literal["status", "state", "alarms", "robot"]
KINDS: Final[tuple[Kind, ...]] = get_args(Kind)
# These come at the client's rate.
PACED: Final = ("state", "robot")


class Writable(Protocol):
    """What the hub needs of a connection; `ws_protocol.Connection` is one."""

    @property
    def can_take(self) -> bool:
        """Whether everything written so far has gone out."""

    def write(self, wire: bytes) -> None:
        """Write without waiting."""

    def dismiss(self, code: int, reason: str) -> None:
        """Close with a reason, whether or not the other side reads."""


def plain_wire(client: Client, frame: StateFrame) -> bytes:
    """A frame for a client of `/ws/state`: a delta if it requested deltas and has the base."""
    if not client.delta:
        return frame.full()
    has_base = frame.base is not None and frame.base.seq == client.sent_seq
    return frame.delta() if has_base else frame.first()


@dataclass(slots=True, eq=False)
class Client:
    """One client: what it requested, what it lacks, and since when its socket is full.

    `min_interval_s` is the mean time between two frames; a frame may come a tenth earlier. `wire`
    serializes a state for this client. `address` is the one whose share of the connections it
    counts towards. `due` is what it lacks, of what it `wants`. `written_s` is the time of the last
    write.
    """

    connection: Writable
    address: str = ""
    delta: bool = False
    min_interval_s: float = 0.0
    wants: Collection[Kind] = KINDS
    wire: Callable[[Client, StateFrame], bytes] = plain_wire
    due: set[Kind] = field(default_factory=set)
    sent_seq: int = 0
    next_s: dict[Kind, float] = field(default_factory=dict)
    written_s: float = 0.0
    blocked_since_s: float | None = None


class Hub:
    """Every client and the newest frame. Belongs to the event loop."""

    def __init__(
        self, max_clients: int, client_timeout_s: float, status_at: Callable[[float], Status]
    ) -> None:
        self.max_clients = max_clients
        self.frames_sent = 0
        self.frames_skipped = 0
        self.bytes_sent = 0
        self.clients_dismissed = 0
        self.client_timeout_s = client_timeout_s
        # In the order in which they joined.
        self._clients: dict[Client, None] = {}
        self.unsent = Unsent()
        self._parties: Counter[str] = Counter()
        self._frame: StateFrame | None = None
        self._beside: dict[Kind, bytes] = {}
        self._status_at = status_at
        self._status_wire: bytes | None = None
        self._status_wire_s = 0.0

    def __len__(self) -> int:
        return len(self._clients)

    def make_place(self, address: str) -> bool:
        """Whether a client from this address may join, which may evict another one.

        One address may take all free places. When none is free, the address with the most clients
        loses its newest one to an address that has at least two fewer.
        """
        if len(self._clients) < self.max_clients:
            return True
        largest, size = max(self._parties.items(), key=lambda party: party[1], default=("", 0))
        if size < self._parties[address] + 2:
            return False
        newest = next(client for client in reversed(self._clients) if client.address == largest)
        self.evict(
            newest, f"{self.max_clients} clients are connected, the limit, {size} of them from here"
        )
        return True

    def evict(self, client: Client, reason: str) -> None:
        """Close a client to make room for others; it may try again."""
        self._close(client, CLOSE_TRY_AGAIN_LATER, reason)

    def _close(self, client: Client, code: int, reason: str) -> None:
        self.leave(client)
        self.clients_dismissed += 1
        client.connection.dismiss(code, reason)

    def evict_all(self, reason: str) -> None:
        """Close every client; each may try again."""
        for client in list(self._clients):
            self.evict(client, reason)

    @property
    def blocked(self) -> int:
        """How many clients have a full socket."""
        return sum(client.blocked_since_s is not None for client in self._clients)

    def join(self, client: Client, now_s: float) -> None:
        """Add a client and give it the status and the current state at once, in that order."""
        self._clients[client] = None
        self._parties[client.address] += 1
        self.want(client, client.wants, now_s)

    def want(self, client: Client, kinds: Collection[Kind], now_s: float) -> None:
        """Have a client get these kinds from now on, beginning with the newest of each."""
        client.wants, client.sent_seq = kinds, 0
        client.next_s.clear()
        known: set[Kind] = {"status", *self._beside}
        if self._frame is not None:
            known.add("state")
        client.due = known.intersection(kinds)
        self.serve(client, now_s)

    def leave(self, client: Client) -> None:
        """Forget a client; harmless if it has left already."""
        self.unsent.let_go(client)
        if client in self._clients:
            del self._clients[client]
            self._parties[client.address] -= 1
            if not self._parties[client.address]:
                del self._parties[client.address]

    def hold(self, client: Client, message: bytes) -> None:
        """Count a large message other than a frame, until the client's socket is free again.

        Past the limit for all of them, the client that has waited longest is closed.
        """
        if len(message) >= LARGE_BYTES and client in self._clients:
            for slowest in self.unsent.hold(client, message):
                self.evict(slowest, "slow to take what it requested, and others need the memory")

    def publish(self, frame: StateFrame, now_s: float) -> None:
        """Make this the newest frame, and send it to every client that can take it."""
        self._frame = frame
        self._send("state", now_s)

    def announce(self, now_s: float) -> None:
        """Send the status, which has changed, to every client that can take it."""
        self._status_wire = None
        self._send("status", now_s)

    def publish_beside(self, kind: Literal["alarms", "robot"], wire: bytes, now_s: float) -> None:
        """Send this changed frame to every client that can take it."""
        self._beside[kind] = wire
        self._send(kind, now_s)

    def _send(self, kind: Kind, now_s: float) -> None:
        for client in self._clients:
            if kind in client.wants:
                client.due.add(kind)
        self.serve_all(now_s)

    def remind(self, now_s: float) -> None:
        """Have clients that were sent nothing for a second get the status when next served.

        A client with a longer frame interval gets it at that interval.
        """
        for client in self._clients:
            silence_s = max(REMINDED_AFTER_S, client.min_interval_s)
            if "status" in client.wants and now_s >= client.written_s + silence_s:
                client.due.add("status")

    def serve_all(self, now_s: float) -> None:
        """Send every client what it lacks and can take now."""
        for client in self._clients:
            self.serve(client, now_s)

    def serve(self, client: Client, now_s: float) -> None:
        """Send a client what it lacks, as far as its socket and its rate allow."""
        for kind in KINDS:
            if kind not in client.due or now_s < client.next_s.get(kind, 0.0):
                continue
            if kind in self._beside and not client.sent_seq:
                continue
            if not self._can_take(client, now_s):
                return
            client.due.discard(kind)
            if kind in PACED and client.min_interval_s:
                due_s = client.next_s.get(kind, 0.0)
                client.next_s[kind] = next_beat_s(due_s, now_s, client.min_interval_s)
            wire = self._wire(kind, client, now_s)
            client.written_s = now_s
            client.connection.write(wire)
            self.bytes_sent += len(wire)
        if self._can_take(client, now_s):
            self.unsent.let_go(client)

    def _can_take(self, client: Client, now_s: float) -> bool:
        """Whether the client's socket has taken everything; notes since when it has not."""
        if client.connection.can_take:
            client.blocked_since_s = None
            return True
        if client.blocked_since_s is None:
            client.blocked_since_s = now_s
        return False

    def _wire(self, kind: Kind, client: Client, now_s: float) -> bytes:
        if kind == "status":
            return self._status_at_once(now_s)
        if kind != "state":
            return self._beside[kind]
        frame = self._frame
        assert frame is not None  # or none is due
        wire = client.wire(client, frame)
        if client.sent_seq:
            self.frames_skipped += frame.seq - client.sent_seq - 1
        self.frames_sent += 1
        client.sent_seq = frame.seq
        return wire

    def dismiss_stuck(self, now_s: float) -> int:
        """Close every client that has not taken a frame for too long; returns how many."""
        stuck = [
            client
            for client in self._clients
            if client.blocked_since_s is not None
            and now_s - client.blocked_since_s >= self.client_timeout_s
        ]
        for client in stuck:
            reason = f"accepted no frame for {self.client_timeout_s:g} s"
            self._close(client, CLOSE_POLICY, reason)
        return len(stuck)

    def _status_at_once(self, now_s: float) -> bytes:
        # Shared by clients served at the same moment, but not cached for later, as it has an age:
        # a client that joins when the twin is long dead must not think its tags seconds old.
        if self._status_wire is None or now_s != self._status_wire_s:
            self._status_wire = text_frame(orjson.dumps(self._status_at(now_s).frame()))
            self._status_wire_s = now_s
        return self._status_wire
