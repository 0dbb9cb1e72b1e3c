"""Frames: numbered, made once in each encoding, and of the contract's types."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import cbor2
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from websockets.frames import Frame, Opcode
from websockets.streams import StreamReader

from lupin_bridge.stream import schema
from lupin_bridge.stream.frames import (
    CBOR,
    ENCODINGS,
    JSON,
    FrameWriter,
    StateFrame,
    binary_frame,
    binary_head,
    status_frame,
    text_frame,
)
from lupin_bridge.stream.status import Status
from lupin_twin.state import Reading, Snapshot, TagState


def received(wire: bytes) -> Frame:
    """What a client makes of the bytes: one whole unmasked frame."""
    reader = StreamReader()
    reader.feed_data(wire)
    parsing = Frame.parse(reader.read_exact, mask=False)
    try:
        while True:
            next(parsing)
    except StopIteration as end:
        frame: Frame = end.value
    assert not reader.buffer
    return frame


def content(wire: bytes, encoding: str = JSON) -> dict[str, Any]:
    """What a frame says."""
    frame = received(wire)
    assert frame.opcode is (Opcode.BINARY if encoding == CBOR else Opcode.TEXT)
    read = cbor2.loads if encoding == CBOR else json.loads
    decoded: dict[str, Any] = read(bytes(frame.data))
    return decoded


def tag(tag_id: str, value: float = 1.0, age_s: float = 1.0) -> TagState:
    return TagState(
        tag_id, readings=(Reading("co2", value),), last_observed_ns=10**10 - int(age_s * 1e9)
    )


def snapshot(*tags: TagState, stamp_ns: int = 10**10) -> Snapshot:
    return Snapshot(stamp_ns, "map", tags)


# --- the wire -----------------------------------------------------------------------------------


def test_a_frame_is_whole_and_unmasked() -> None:
    for size in (0, 125, 126, 65_535, 65_536):  # RFC 6455, section 5.2: the lengths change there
        for make, opcode in ((text_frame, Opcode.TEXT), (binary_frame, Opcode.BINARY)):
            frame = received(make(b"x" * size))
            assert (frame.opcode, frame.fin, bytes(frame.data)) == (opcode, True, b"x" * size)
        assert binary_head(size) + b"x" * size == binary_frame(b"x" * size)


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_a_status_frame_is_the_contracts(encoding: str) -> None:
    frame = schema.StatusFrame.model_validate(
        content(status_frame(Status("stale", 4.0), encoding), encoding), strict=True
    )
    assert (frame.twin, frame.reason, frame.state_age_seconds) == ("offline", "stale", 4.0)


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_a_state_frame_is_the_contracts_and_carries_its_revision(encoding: str) -> None:
    frame = FrameWriter().state(snapshot(tag("7", 412.5)), 'a"b-7')
    state = schema.StateFrame.model_validate(content(frame.full(encoding), encoding))
    assert (state.seq, state.revision) == (frame.seq, frame.revision) == (1, 'a"b-7')
    assert state.state.tags[0].readings[0].value == 412.5


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_a_delta_frame_is_the_contracts(encoding: str) -> None:
    writer = FrameWriter()
    same = tag("same")
    writer.state(snapshot(same, tag("gone")), "r1")
    frame = writer.state(snapshot(same, tag("new", 2.0)), "r2")
    delta = schema.DeltaFrame.model_validate(content(frame.delta(encoding), encoding))
    assert (delta.seq, delta.base, delta.revision) == (2, 1, "r2")
    assert [changed.tag_id for changed in delta.changed] == ["new"]
    assert delta.removed == ["gone"]
    assert delta.header == schema.Header(stamp=schema.Time(sec=10, nanosec=0), frame_id="map")


def test_both_encodings_say_the_same() -> None:
    odd = TagState("ä", readings=(Reading("co2", float("nan")), Reading("light", 1e300)))
    frame = FrameWriter().state(snapshot(odd, tag("7")), "r")
    assert content(frame.full(JSON)) == content(frame.full(CBOR), CBOR)


def test_seq_grows_by_one_a_frame() -> None:
    writer = FrameWriter()
    assert [writer.state(snapshot(), "r").seq for _ in range(4)] == [1, 2, 3, 4]


# --- made once, kept no longer than needed ------------------------------------------------------


def test_a_frame_is_written_once_for_all_clients() -> None:
    writer = FrameWriter()
    writer.state(snapshot(), "r")
    frame = writer.state(snapshot(tag("7")), "r")
    for encoding in ENCODINGS:
        assert frame.full(encoding) is frame.full(encoding)
        assert frame.delta(encoding) is frame.delta(encoding)


def test_no_more_than_two_frames_are_kept() -> None:
    writer = FrameWriter()
    frames: list[StateFrame] = []
    for number in range(4):
        frames.append(writer.state(snapshot(tag("7", number)), "r"))
        frames[-1].full(JSON)
    assert frames[3].base is frames[2]
    assert frames[2].base is None, "or every frame ever made would stay in memory"


# --- deltas -------------------------------------------------------------------------------------

STEPS = st.lists(
    st.dictionaries(st.sampled_from("abcdef"), st.integers(0, 2), max_size=6),
    min_size=2,
    max_size=6,
)


def apply(state: dict[str, Any], delta: dict[str, Any]) -> dict[str, Any]:
    """What a client does with a delta, as `schema.DeltaFrame` tells it."""
    tags = {tag["tag_id"]: tag for tag in state["tags"] if tag["tag_id"] not in delta["removed"]}
    tags.update((tag["tag_id"], tag) for tag in delta["changed"])
    return {"header": delta["header"], "tags": list(tags.values())}


def ageless(state: dict[str, Any]) -> dict[str, Any]:
    """A state without ages: those of unchanged tags are for the client to reckon."""
    tags = sorted(state["tags"], key=lambda tag: str(tag["tag_id"]))
    return {**state, "tags": [{**tag, "stale_seconds": None} for tag in tags]}


@given(STEPS)
@settings(max_examples=100)
def test_who_applies_the_deltas_has_the_state(steps: list[dict[str, int]]) -> None:
    writer, known = FrameWriter(), dict[str, TagState]()
    mine: dict[str, Any] = {}
    for number, step in enumerate(steps):
        # As in the store: a tag that did not change is the very same value.
        known = {
            tag_id: known[tag_id]
            if tag_id in known and known[tag_id].readings[0].value == value
            else tag(tag_id, value)
            for tag_id, value in step.items()
        }
        frame = writer.state(snapshot(*known.values(), stamp_ns=number), "r")
        whole = content(frame.full(JSON))["state"]
        if frame.base is None:
            mine = whole
            continue
        delta = content(frame.delta(JSON))
        assert len(delta["changed"]) <= len(step)
        mine = apply(mine, delta)
        assert ageless(mine) == ageless(whole)


def test_a_delta_leaves_out_what_did_not_change_and_appends_what_is_new_in_order() -> None:
    writer = FrameWriter()
    tags = [tag("a"), tag("b")]
    first = writer.state(snapshot(*tags), "r")
    tags = [tags[0], replace(tags[1], readings=()), tag("z"), tag("c")]
    second = writer.state(snapshot(*tags), "r")
    delta = content(second.delta(JSON))
    assert [changed["tag_id"] for changed in delta["changed"]] == ["b", "z", "c"]
    whole = content(second.full(JSON))["state"]
    assert apply(content(first.full(JSON))["state"], delta)["tags"] == whole["tags"]
