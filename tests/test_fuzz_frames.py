"""30,000 unexpected WebSocket frames, to `/ws/state`, `/rosbridge` and `/foxglove`.

Two kinds: valid frames with any content, which are ignored or refused; and frames that break the
protocol, each of which ends its connection. Meanwhile a healthy
client gets its states, and afterwards nothing is left of the others.
"""

import json
import random
import struct
from collections.abc import Iterator

import pytest

from lupin_bridge.serving.ws_protocol import FRAMES_AT_ONCE
from tests.support.messages import scan
from tests.support.proc_stat import open_files, peak_mb, reset_peak, resident_mb
from tests.support.raw_ws import (
    BINARY,
    CLOSE,
    CONT,
    PING,
    PONG,
    TEXT,
    RawClient,
    masked,
    random_payload,
)
from tests.support.waiting import wait_for
from tests.support.web import Bridge, bridge

FRAMES = 14_000
BROKEN_CONNECTIONS = 500
# In all; one connection may make the server buffer a message of 64 kB.
MEMORY_MB = 10.0

# Clients must not be able to fill a disk.
LOG_LINES = 50

# RFC 6455, section 7.4.1; 1011, an internal error, is not among them.
NORMAL, PROTOCOL_ERROR, NO_UTF8, POLICY, TOO_BIG = 1000, 1002, 1007, 1008, 1009
ROSBRIDGE_OPS = (
    *("subscribe", "unsubscribe", "call_service", "advertise", "publish", "fragment", "png"),
    *("set_level", "status", "auth", "", None, 7),
)


@pytest.fixture(scope="module")
def live() -> Iterator[Bridge]:
    with bridge(afresh=True) as running:
        running.peer.observe(scan("1", {"co2": 400.0}, (0, 0)))
        running.tag("1")
        yield running


def any_json(chance: random.Random, depth: int = 3) -> object:
    """A JSON value of any kind."""
    kind = chance.randrange(8 if depth else 6)
    if kind == 6:
        return [any_json(chance, depth - 1) for _ in range(chance.randrange(4))]
    if kind == 7:
        keys = ("topic", "type", "service", "args", "id", "sensor_type", "throttle_rate", "x")
        return {chance.choice(keys): any_json(chance, depth - 1) for _ in range(4)}
    return (None, True, -1, 1e308, "/twin/state", "\x00\ud800\u202e" * chance.randrange(9))[kind]


def anything(chance: random.Random) -> bytes:
    """A frame, or a message in pieces, as a proper client could send it."""
    kind = chance.randrange(7)
    payload = random_payload(chance, 3_000)
    if kind == 0:
        return masked(BINARY, payload)
    if kind == 1:
        return masked(chance.choice((PING, PONG)), payload[:125])
    if kind == 2:
        text = json.dumps({"op": chance.choice(ROSBRIDGE_OPS), "x": any_json(chance)})
        return masked(TEXT, text.encode())
    if kind == 3:
        members = any_json(chance)
        rosbridge: dict[str, object] = {"op": chance.choice(ROSBRIDGE_OPS)}
        rosbridge |= members if isinstance(members, dict) else {"topic": members}
        return masked(TEXT, json.dumps(rosbridge).encode())
    text = payload.decode("utf-8", "replace")
    if kind == 6:
        text = chance.choice(("[" * 15_000, '{"a":' * 3_000, "1e999", "null", '{"op":{}}'))
    if kind in (4, 6):
        return masked(TEXT, text.encode())
    return masked(TEXT, text.encode(), fin=False) + masked(PING, b"") + masked(CONT, b"end")


def broken(chance: random.Random) -> bytes:
    """A frame that breaks the protocol."""
    payload = random_payload(chance, 2_000)
    kinds = (
        masked(chance.choice((3, 4, 5, 6, 7, 11, 12, 13, 14, 15)), payload),  # reserved
        masked(TEXT, payload, rsv=chance.randrange(1, 8)),
        masked(CONT, payload),  # of nothing
        masked(TEXT, b"", fin=False) + masked(TEXT, payload),  # a new one inside another
        masked(chance.choice((PING, PONG, CLOSE)), bytes(126)),  # too long for control
        masked(PING, b"", fin=False),  # control in pieces
        masked(CLOSE, b"\x03"),  # half a code
        masked(CLOSE, struct.pack("!H", chance.choice((0, 999, 1004, 1005, 1006, 1015, 65_535)))),
        masked(CLOSE, struct.pack("!H", 1000) + b"\xff\xfe"),
        masked(TEXT, b"\xff\xc0\x80" + payload),  # no UTF-8
        bytes([0x80 | TEXT, 5]) + b"plain",  # not masked
        bytes([0x80 | BINARY, 0xFF]) + struct.pack("!Q", 1 << 63),  # a length below zero
        bytes([0x80 | BINARY, 0xFF]) + struct.pack("!Q", 1 << 40),  # a terabyte
        masked(BINARY, bytes(70_000)),
        b"GET / HTTP/1.1\r\n\r\n",
        chance.randbytes(chance.randrange(1, 200)),
    )
    return chance.choice(kinds)


def closing_code(frames: list[tuple[int, bytes]]) -> int | None:
    """The code of the close frame at the end; None where there is none."""
    if not frames or frames[-1][0] != CLOSE:
        return None
    return int.from_bytes(frames[-1][1][:2])


@pytest.mark.parametrize(
    ("path", "at_once", "frames"),
    [
        ("/ws/state", FRAMES_AT_ONCE // 2, FRAMES),
        ("/rosbridge", FRAMES_AT_ONCE // 2, FRAMES),
        ("/foxglove", FRAMES_AT_ONCE // 2, FRAMES // 7),
    ],
)
def test_unexpected_frames_change_nothing(
    live: Bridge, path: str, at_once: int, frames: int
) -> None:
    chance = random.Random(path)
    pid = live.process.pid
    with live.listen() as healthy:
        before = healthy.until("state")["seq"]
        with RawClient(live.url, path) as client:
            client.exchange(masked(CLOSE, b"\x03\xe8"))
        memory, files = resident_mb(pid), open_files(pid)
        reset_peak(pid)
        for _ in range(frames // at_once):
            with RawClient(live.url, path) as client:
                message = b"".join(anything(chance) for _ in range(at_once))
                received = client.exchange(message + masked(CLOSE, struct.pack("!H", NORMAL)))
                # A message in pieces has more than one frame: some connections send too much.
                assert closing_code(received) in (NORMAL, POLICY)
            healthy.rest()
        for _ in range(BROKEN_CONNECTIONS):
            with RawClient(live.url, path) as client:
                message = anything(chance) + broken(chance)
                assert closing_code(client.exchange(message)) in (
                    *(None, NORMAL, PROTOCOL_ERROR, NO_UTF8, TOO_BIG),
                )
        healthy.rest()
        wait_for(lambda: open_files(pid) <= files, "the end of all connections")
        assert peak_mb(pid) - memory < MEMORY_MB
        live.peer.observe(scan(f"after {path}", {"co2": 1.0}))
        assert healthy.until_tag(f"after {path}")["seq"] > before
    assert live.json("/healthz") | {"message": ""} == {
        "ok": True,
        "message": "",
        "callback_errors": 0,
    }
    assert "Traceback" not in live.process.output
    assert live.process.output.count("\n") < LOG_LINES
