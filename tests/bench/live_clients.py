"""Many WebSocket clients in one process apart from the server, at the least cost.

No asyncio and no JSON parser: one epoll loop reads each socket, finds the ends of frames by their
headers, and in a frame looks for two numbers, `seq` and the robot's beat, as bytes.

Run as `python -m tests.bench.live_clients --port P --path /ws/state --clients N --connect-at T`.
It connects all clients at the monotonic time T and prints one JSON object a line:

    {"joined_s": [...]}           when all have their first state: seconds since T, of each client
    {"delays_s": [...], "received": {"seq": count}, "frame_bytes": n}
                                  after `measure T0 T1` on standard input; about the frames whose
                                  beat was published from T0 to T1
"""

import argparse
import json
import re
import resource
import select
import socket
import sys
import time
from collections import Counter
from dataclasses import dataclass, field

READ_BYTES = 1 << 18
# After the end of the measurement, for frames still under way.
DRAIN_S = 1.5
_SEQ = b'"seq":'
_BEAT = re.compile(rb'"name":"beat","value":([\d.]+)')


@dataclass(slots=True, eq=False)
class Stream:
    """One client: its socket, the bytes of an unfinished frame, and the latest beat it received."""

    socket: socket.socket
    missing: int = 0
    is_upgraded: bool = False
    beat: float = 0.0
    parts: list[bytes] = field(default_factory=list)


class Clients:
    def __init__(self, path: str, port: int) -> None:
        self._path, self._port = path, port
        self._poll = select.epoll()
        self._streams: dict[int, Stream] = {}
        self._window = (float("inf"), float("inf"))
        self._joined: list[float] = []
        self._delays: list[float] = []
        self._received: Counter[int] = Counter()
        self._bytes = 0
        self._connected_at = 0.0
        self._now = 0.0

    def connect(self, count: int) -> None:
        """Open all connections, without waiting for any."""
        self._connected_at = time.monotonic()
        for _ in range(count):
            client = socket.socket()
            client.setblocking(False)
            client.connect_ex(("127.0.0.1", self._port))
            self._streams[client.fileno()] = Stream(client)
            self._poll.register(client, select.EPOLLOUT)

    def run(self, count: int) -> None:
        """Serve until standard input ends."""
        self._poll.register(sys.stdin, select.EPOLLIN)
        has_reported = False
        while True:
            events = self._poll.poll(0.5)
            for fd, event in events:
                if fd == sys.stdin.fileno():
                    command = sys.stdin.readline().split()
                    if not command:
                        return
                    self._window = (float(command[1]), float(command[2]))
                elif event & select.EPOLLOUT:
                    self._upgrade(self._streams[fd])
                elif not self._read(self._streams[fd]):
                    self._poll.unregister(fd)
            if not has_reported and len(self._joined) == count:
                has_reported = True
                report(joined_s=self._joined)
            if time.monotonic() > self._window[1] + DRAIN_S:
                self._report()

    def _report(self) -> None:
        frames = sum(self._received.values())
        report(
            delays_s=[round(delay, 5) for delay in self._delays],
            received=self._received,
            frame_bytes=self._bytes / frames if frames else 0,
        )
        self._window = (float("inf"), float("inf"))
        self._delays, self._bytes = [], 0
        self._received.clear()

    def _upgrade(self, stream: Stream) -> None:
        error = stream.socket.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
        if error:
            raise OSError(error, "cannot connect")
        stream.socket.send(
            f"GET {self._path} HTTP/1.1\r\nHost: 127.0.0.1:{self._port}\r\nUpgrade: websocket\r\n"
            "Connection: Upgrade\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
            "Sec-WebSocket-Version: 13\r\n\r\n".encode()
        )
        self._poll.modify(stream.socket, select.EPOLLIN)

    def _read(self, stream: Stream) -> bool:
        """Read what is there; False at the end of the connection."""
        try:
            data = stream.socket.recv(READ_BYTES)
        except ConnectionResetError:
            return False
        if not data:
            return False
        self._now = time.monotonic()
        if len(data) < stream.missing:  # the middle of a frame
            stream.parts.append(data)
            stream.missing -= len(data)
            return True
        if stream.parts:
            data = b"".join((*stream.parts, data))
            stream.parts.clear()
        if not stream.is_upgraded:
            head, end, rest = data.partition(b"\r\n\r\n")
            if not end:
                stream.parts.append(data)
                return True
            if not head.startswith(b"HTTP/1.1 101 "):
                raise ConnectionError(head.decode())
            stream.is_upgraded = True
            data = rest
        self._split(stream, data)
        return True

    def _split(self, stream: Stream, data: bytes) -> None:
        """Take the whole frames (RFC 6455, section 5.2; a server does not mask)."""
        start, end = 0, len(data)
        stream.missing = 0
        while end - start >= 2:
            length = data[start + 1]
            header = 2 if length < 126 else 4 if length == 126 else 10
            if end - start < header:
                break
            if header > 2:
                length = int.from_bytes(data[start + 2 : start + header])
            if end - start < header + length:
                stream.missing = header + length - (end - start)
                break
            if data[start] == 0x81:  # a text frame, whole
                self._frame(stream, data, start + header, start + header + length)
            elif data[start] == 0x89:  # a ping: without an answer the server closes after 40 s
                payload = data[start + header : start + header + length]
                stream.socket.send(bytes((0x8A, 0x80 | length, 0, 0, 0, 0)) + payload)
            start += header + length
        if start < end:
            stream.parts.append(data[start:])

    def _frame(self, stream: Stream, data: bytes, start: int, end: int) -> None:
        at = data.find(_SEQ, start, start + 64)
        if at < 0:
            return  # a status
        if not stream.beat:
            self._joined.append(self._now - self._connected_at)
            stream.beat = -1.0
        seq = _number(data, at + len(_SEQ))
        beat = max(map(float, _BEAT.findall(data, start, end)), default=stream.beat)
        if beat > stream.beat:
            stream.beat = beat
            if self._window[0] <= beat <= self._window[1]:
                self._delays.append(self._now - beat)
        if self._window[0] <= stream.beat <= self._window[1]:
            self._received[int(seq)] += 1
            self._bytes += end - start


def _number(data: bytes, start: int) -> float:
    end = start
    while data[end] in b"0123456789.":
        end += 1
    return float(data[start:end])


def report(**what: object) -> None:
    print(json.dumps(what), flush=True)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--port", type=int, required=True)
    parser.add_argument("--path", default="/ws/state")
    parser.add_argument("--clients", type=int, required=True)
    parser.add_argument("--connect-at", type=float, required=True)
    options = parser.parse_args()
    hard = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    clients = Clients(options.path, options.port)
    # All processes start at one moment: waiting for each other would shift them.
    time.sleep(max(0.0, options.connect_at - time.monotonic()))
    clients.connect(options.clients)
    clients.run(options.clients)


if __name__ == "__main__":
    main()
