"""WebSocket frames of the state: each written once, and shared by every client.

Pure. A frame is written when the first client asks for it, and kept for the others.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import orjson
from websockets.frames import Frame, Opcode

from lupin_bridge.alarms.board import Board, notes_of_alarms
from lupin_bridge.judge.judging import NOTHING_JUDGED, Judged
from lupin_bridge.stream.state_json import (
    StateJson,
    alarms_body,
    alarms_in_frame,
    header,
    judgement,
    judgement_since,
)
from lupin_bridge.stream.status import Status
from lupin_twin.core.notes import Note
from lupin_twin.core.state import Snapshot, TagState


def text_frame(payload: bytes) -> bytes:
    """UTF-8 text as one WebSocket text frame; a server does not mask (RFC 6455, section 5.1)."""
    return Frame(Opcode.TEXT, payload).serialize(mask=False)


def alarms_message(now: Board, now_ns: int | None, notes: tuple[Note, ...], count: int) -> bytes:
    """`schema.AlarmsFrame`: the alarms, and what people said of them; `count` notes in all."""
    said = notes_of_alarms(now.alarms, notes, now_ns)
    body = alarms_body(alarms_in_frame(now.page, now_ns), now.source, now.since_ns, said)
    return text_frame(orjson.dumps({"type": "alarms", "notes": count, **body}))


def status_frame(status: Status) -> bytes:
    """A status as a WebSocket frame."""
    return text_frame(orjson.dumps(status.frame()))


@dataclass(slots=True, eq=False)
class StateFrame:
    """One state on its way to every client.

    `base` is the frame before it, whose own base is cut off: a delta goes back by one.
    """

    seq: int
    revision: str
    snapshot: Snapshot
    judged: Judged
    base: StateFrame | None
    _writer: FrameWriter
    _written: dict[str, bytes] = field(default_factory=dict)

    @property
    def json(self) -> bytes:
        """The state as JSON of `schema.TwinState`; 10 ms of work for 10,000 tags, if asked for."""
        return self._once("json", lambda: self._writer.json.state(self.snapshot))

    @property
    def message_json(self) -> bytes:
        """The state as JSON of lupin_msgs/TwinState, for who reads the message itself."""
        return self._once("message", lambda: self._writer.message_json.state(self.snapshot))

    def let_go(self) -> None:
        """Keep only what a delta needs: or every frame ever made would stay in memory."""
        self.base = None
        self._written.clear()

    def full(self) -> bytes:
        """`schema.StateFrame` as a WebSocket frame."""
        return self.wire("full", self._full)

    def delta(self) -> bytes:
        """`schema.DeltaFrame` as a WebSocket frame: only what is not as in `base`."""
        return self.wire("delta", self._delta)

    def wire(self, kind: str, payload: Callable[[], bytes]) -> bytes:
        """The frame of this kind, from `payload()` if it is the first call."""
        return self._once(f"wire {kind}", lambda: text_frame(payload()))

    def _once(self, what: str, write: Callable[[], bytes]) -> bytes:
        if what not in self._written:
            self._written[what] = write()
        return self._written[what]

    def _full(self) -> bytes:
        return b'{"type":"state","seq":%d,"revision":%b,"state":%b,"health":%b}' % (
            self.seq,
            orjson.dumps(self.revision),
            self.json,
            judgement(self.judged),
        )

    def _delta(self) -> bytes:
        assert self.base is not None  # the hub asks only then
        changed, removed = difference(self.base.snapshot.tags, self.snapshot.tags)
        stamp_ns = self.snapshot.stamp_ns
        return (
            b'{"type":"delta","seq":%d,"base":%d,"revision":%b,"header":%b,'
            b'"changed":[%b],"removed":%b,"health":%b}'
        ) % (
            self.seq,
            self.base.seq,
            orjson.dumps(self.revision),
            orjson.dumps(header(stamp_ns, self.snapshot.frame_id)),
            b",".join([self._writer.json.tag(tag, self.snapshot.now_ns) for tag in changed]),
            orjson.dumps(removed),
            judgement_since(self.base.judged, self.judged),
        )


def difference(
    before: Sequence[TagState], after: Sequence[TagState]
) -> tuple[list[TagState], list[str]]:
    """The tags of `after` that are not the very same in `before`, and the tag_ids that are gone.

    Tags keep their places for as long as a twin lives, new ones come behind them: place by place,
    10,000 tags take 0.3 ms. Only a twin that was restarted makes a look-up by name necessary.
    """
    pairs = [(old, new) for old, new in zip(before, after, strict=False) if old is not new]
    if len(after) >= len(before) and all(old.tag_id == new.tag_id for old, new in pairs):
        return [*(new for _, new in pairs), *after[len(before) :]], []
    left = {tag.tag_id: tag for tag in before}
    changed = [tag for tag in after if left.pop(tag.tag_id, None) is not tag]
    return changed, list(left)


class FrameWriter:
    """Numbers the frames; `seq` starts at 1 and grows by one a frame."""

    def __init__(self) -> None:
        self.json = StateJson()
        self.message_json = StateJson(has_times=False)
        self._newest: StateFrame | None = None

    def state(
        self, snapshot: Snapshot, revision: str, judged: Judged = NOTHING_JUDGED
    ) -> StateFrame:
        """The next state frame, and what is to be said of that state."""
        base = self._newest
        if base is not None:
            base.let_go()
        frame = StateFrame(
            seq=1 if base is None else base.seq + 1,
            revision=revision,
            snapshot=snapshot,
            judged=judged,
            base=base,
            _writer=self,
        )
        self._newest = frame
        self.json.keep_only(snapshot)
        self.message_json.keep_only(snapshot)
        return frame
