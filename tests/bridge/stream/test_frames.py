"""Frames: numbered, made once, and of the contract's types."""

import json
from collections import Counter
from dataclasses import replace
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st

from lupin_bridge.judge.judging import Judge
from lupin_bridge.stream.frames import FrameWriter, StateFrame
from lupin_twin.core.state import Attempt, Pose, Reading, Snapshot, TagState
from tests.support.raw_ws import TEXT, frames_of
from tests.support.seen import BY_LIGHT


def received(wire: bytes) -> bytes:
    """A client's view of the bytes: the text of one whole frame."""
    [(opcode, data)] = frames_of(wire)
    assert (opcode, wire[0] >> 7) == (TEXT, 1)
    return data


def content(wire: bytes) -> dict[str, Any]:
    """The content of a frame."""
    decoded: dict[str, Any] = json.loads(received(wire))
    return decoded


def tag(tag_id: str, value: float = 1.0, age_s: float = 1.0) -> TagState:
    return TagState(
        tag_id, readings=(Reading("co2", value),), last_observed_ns=10**10 - int(age_s * 1e9)
    )


def snapshot(*tags: TagState, stamp_ns: int = 10**10) -> Snapshot:
    return Snapshot(stamp_ns, "map", tags)


# --- made once, dropped when no longer needed ---------------------------------------------------


def test_no_more_than_two_frames_are_cached() -> None:
    writer = FrameWriter()
    frames: list[StateFrame] = []
    for number in range(4):
        frames.append(writer.state(snapshot(tag("7", number)), "r"))
        frames[-1].full()
    assert frames[3].base is frames[2]
    assert frames[2].base is None, "or every frame ever made would stay in memory"


# --- deltas -------------------------------------------------------------------------------------

STEPS = st.lists(
    st.dictionaries(st.sampled_from("abcdef"), st.integers(0, 2), max_size=6),
    min_size=2,
    max_size=6,
)


def apply(state: dict[str, Any], delta: dict[str, Any]) -> dict[str, Any]:
    """What a client does with a delta, as `schema.DeltaFrame` describes it."""
    tags = {tag["tag_id"]: tag for tag in state["tags"] if tag["tag_id"] not in delta["removed"]}
    tags.update((tag["tag_id"], tag) for tag in delta["changed"])
    return {"header": delta["header"], "tags": list(tags.values())}


def ageless(state: dict[str, Any]) -> dict[str, Any]:
    """A state without ages: the client computes those of unchanged tags."""
    tags = sorted(state["tags"], key=lambda tag: str(tag["tag_id"]))
    return {**state, "tags": [{**tag, "stale_seconds": None} for tag in tags]}


@given(STEPS)
@settings(max_examples=100)
def test_applying_the_deltas_gives_the_state(steps: list[dict[str, int]]) -> None:
    writer, known = FrameWriter(), dict[str, TagState]()
    mine: dict[str, Any] = {}
    for number, step in enumerate(steps):
        # As in the store: an unchanged tag is the same object.
        known = {
            tag_id: known[tag_id]
            if tag_id in known and known[tag_id].readings[0].value == value
            else tag(tag_id, value)
            for tag_id, value in step.items()
        }
        frame = writer.state(snapshot(*known.values(), stamp_ns=number), "r")
        whole = content(frame.full())["state"]
        if frame.base is None:
            mine = whole
            continue
        delta = content(frame.delta())
        assert len(delta["changed"]) <= len(step)
        mine = apply(mine, delta)
        assert ageless(mine) == ageless(whole)


# --- size ---------------------------------------------------------------------------------------

# What every browser gets ten times a second, for thirty tags with five sensors each.
MAX_GREENHOUSE_BYTES = 16_000


def greenhouse() -> Snapshot:
    """As after a patrol: each tag scanned once, half a minute after the one before."""
    now_ns = 1_790_000_123_456_789_012
    values = {"temperature": 21.3, "humidity": 64.0, "co2": 612.0, "light": 742.5, "ph": 6.2}
    tags = []
    for number in range(30):
        at_ns = now_ns - (30 - number) * 31_234_567_891
        wrong = {"co2": 5000.0} if number % 10 == 0 else {}
        tags.append(
            TagState(
                str(number + 1),
                pose=Pose(0.5 * (number % 6), 0.7 * (number // 6), 0.0, 0.0, 0.0, 0.0, 1.0),
                readings=tuple(Reading(*each, at_ns) for each in (values | wrong).items()),
                last_observed_ns=at_ns,
                last_try=Attempt(at_ns),
            )
        )
    return Snapshot(now_ns, "map", tuple(tags))


def test_a_frame_of_a_greenhouse_is_within_its_budget_of_bytes() -> None:
    scanned = greenhouse()
    judged = Judge(replace(BY_LIGHT, recent_s=3600.0)).see(scanned)
    verdicts = Counter(health.verdict for health in judged.tags.values())
    assert verdicts == {"healthy": 27, "critical": 3}
    frame = FrameWriter().state(scanned, "0123456789abcdef-1234-5", judged)
    assert len(frame.full()) <= MAX_GREENHOUSE_BYTES
