"""Snapshot to CBOR: the same as the JSON, to the last field."""

from __future__ import annotations

from dataclasses import replace

import cbor2
import orjson
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lupin_bridge.stream.frames import CBOR, JSON, FrameWriter
from lupin_bridge.stream.state_cbor import StateCbor, array, mapping
from lupin_bridge.stream.state_json import StateJson
from lupin_twin.state import Reading, Snapshot, TagState
from tests.bridge.stream.test_frames import received
from tests.bridge.stream.test_state_json import SNAPSHOTS, STAMP_NS, TAGS


@given(SNAPSHOTS, st.lists(STAMP_NS, min_size=1, max_size=3))
def test_it_says_what_the_json_says_and_as_anybody_would_encode_it(
    snapshot: Snapshot, moments_ns: list[int]
) -> None:
    json, cbor = StateJson(), StateCbor()
    for now_ns in moments_ns:  # what was kept the first time serves the others
        expected = orjson.loads(json.state(snapshot, now_ns))
        encoded = cbor.state(snapshot, now_ns)
        assert cbor2.loads(encoded) == expected
        assert encoded == cbor2.dumps(expected)


@given(SNAPSHOTS, st.lists(TAGS, max_size=3))
def test_frames_say_the_same_in_both_encodings(snapshot: Snapshot, more: list[TagState]) -> None:
    writer = FrameWriter()
    writer.state(snapshot, "a").full(CBOR)
    known = {tag.tag_id for tag in more}
    kept = [tag for tag in snapshot.tags if tag.tag_id not in known]
    new = {tag.tag_id: tag for tag in more}
    frame = writer.state(replace(snapshot, tags=(*kept, *new.values())), "b")
    for write in (frame.full, frame.delta):
        expected = orjson.loads(bytes(received(write(JSON)).data))
        assert bytes(received(write(CBOR)).data) == cbor2.dumps(expected)


@pytest.mark.parametrize("length", [0, 23, 24, 255, 256, 65_535, 65_536])
def test_heads_are_the_shortest_at_every_length(length: int) -> None:
    assert array([b"\x00"] * length) == cbor2.dumps([0] * length)
    fields = {f"{number}": 0 for number in range(length)}
    assert mapping((name, b"\x00") for name in fields) == cbor2.dumps(fields)


def test_only_what_has_changed_is_encoded_again(monkeypatch: pytest.MonkeyPatch) -> None:
    written: list[str] = []
    plain = StateCbor.write

    def noting(fields: dict[str, object]) -> bytes:
        written.append(str(fields["tag_id"]))
        return plain(fields)

    monkeypatch.setattr(StateCbor, "write", staticmethod(noting))
    cbor = StateCbor()
    tags = tuple(TagState(f"{number}", readings=(Reading("co2", 1.0),)) for number in range(3))
    cbor.state(Snapshot(0, "map", tags))
    cbor.state(Snapshot(1, "map", tags))
    assert written == ["0", "1", "2"]
    changed = replace(tags[1], readings=(Reading("co2", 2.0),))
    cbor.state(Snapshot(2, "map", (tags[0], changed, tags[2])))
    assert written == ["0", "1", "2", "1"]
