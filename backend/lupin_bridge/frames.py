"""WebSocket frames: each made once, ready for the wire, and shared by every client."""

from __future__ import annotations

from dataclasses import dataclass

import orjson
from websockets.frames import Frame, Opcode

from lupin_bridge.state_json import StateJson
from lupin_bridge.status import Status
from lupin_twin.state import Snapshot


def text_frame(payload: bytes) -> bytes:
    """UTF-8 text as one WebSocket text frame; a server does not mask (RFC 6455, section 5.1)."""
    return Frame(Opcode.TEXT, payload).serialize(mask=False)


def status_frame(status: Status) -> bytes:
    """A status as a WebSocket frame."""
    return text_frame(orjson.dumps(status.frame()))


@dataclass(frozen=True, slots=True)
class StateFrame:
    """One state on its way to every client."""

    seq: int
    revision: str
    snapshot: Snapshot
    wire: bytes


class FrameWriter:
    """Numbers the frames and writes them; `seq` starts at 1 and grows by one a frame."""

    def __init__(self) -> None:
        self._seq = 0
        self.json = StateJson()

    def state(self, snapshot: Snapshot, revision: str) -> StateFrame:
        """The next state frame."""
        self._seq += 1
        payload = b'{"type":"state","seq":%d,"revision":%b,"state":%b}' % (
            self._seq,
            orjson.dumps(revision),
            self.json.state(snapshot),
        )
        return StateFrame(self._seq, revision, snapshot, text_frame(payload))
