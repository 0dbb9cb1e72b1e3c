"""TF: positions along a chain of transforms, and every reason why there is none."""

import math
import random
from itertools import pairwise

import numpy as np
import pytest

from lupin_twin.adapt.messages import (
    MAX_FRAMES,
    MAX_STEPS,
    WAIT_NS,
    FrameError,
    Frames,
    Sightings,
    Transform,
)

S = 1_000_000_000
NOW = 100 * S
STRAIGHT = (0.0, 0.0, 0.0, 1.0)


def step(
    parent: str,
    *move: float,
    turn: tuple[float, float, float, float] = STRAIGHT,
    stamp_ns: int | None = NOW,
) -> Transform:
    x, y, z = move
    return Transform(parent, stamp_ns, (x, y, z), turn)


def frames_of(**steps: Transform) -> Frames:
    frames = Frames()
    for frame, transform in steps.items():
        frames.put(frame, transform)
    return frames


def test_any_chain_is_the_product_of_its_matrices() -> None:
    dice = random.Random(7)
    names = [f"f{number}" for number in range(MAX_STEPS)]
    frames, matrix = Frames(), np.eye(4)
    assert frames.place("f0", "f0", NOW, S) == (0.0, 0.0, 0.0)
    for parent, frame in pairwise(names):
        turn = tuple(dice.gauss(0, 1) for _ in range(4))
        move = tuple(dice.uniform(-3, 3) for _ in range(3))
        frames.put(frame, Transform(parent, NOW, move, turn))  # type: ignore[arg-type]
        x, y, z, w = np.array(turn) / np.linalg.norm(turn)
        own = np.eye(4)
        own[:3, :3] = [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
        own[:3, 3] = move
        matrix = matrix @ own
        assert frames.place(frame, "f0", NOW, S) == pytest.approx(tuple(matrix[:3, 3]))


@pytest.mark.parametrize(
    ("steps", "complaint"),
    [
        ({}, "TF has no path from 'tag' to 'map' (frame_id): it ends at 'tag'"),
        ({"tag": step("camera", 0, 0, 0)}, "it ends at 'camera'"),
        (
            {"tag": step("map", 0, 0, 0, stamp_ns=NOW - 3 * S)},
            "the transform from 'map' to 'tag' is 3.0 s old, the limit is 2 s",
        ),
        ({"tag": step("map", 0, 0, 0, stamp_ns=NOW + 11 * S)}, "is -11.0 s old"),
        ({"tag": step("a", 0, 0, 0), "a": step("tag", 0, 0, 0)}, "TF has a loop"),
    ],
)
def test_a_missing_chain_is_reported_by_name(steps: dict[str, Transform], complaint: str) -> None:
    with pytest.raises(FrameError) as refused:
        frames_of(**steps).place("tag", "map", NOW, 2 * S)
    assert complaint in str(refused.value)


def test_the_latest_transform_counts_and_a_static_one_has_no_age() -> None:
    frames = frames_of(base=step("map", 1, 0, 0), camera=step("base", 0, 1, 0, stamp_ns=None))
    frames.put("base", step("map", 2, 0, 0, stamp_ns=NOW + 9 * S))
    assert frames.place("camera", "map", NOW + 10 * S, 2 * S) == (2, 1, 0)
    assert frames.stamp_ns("base") == NOW + 9 * S
    assert frames.stamp_ns("camera") is None


@pytest.mark.parametrize(
    "transform",
    [
        step("map", math.nan, 0, 0),
        step("map", math.inf, 0, 0),
        step("map", 0, 0, 0, turn=(0, 0, 0, 0)),
        step("map", 0, 0, 0, turn=(0, math.nan, 0, 1)),
        step("", 0, 0, 0),
        step("m" * 300, 0, 0, 0),
    ],
)
def test_an_invalid_transform_is_refused(transform: Transform) -> None:
    frames = Frames()
    with pytest.raises(FrameError):
        frames.put("base", transform)
    assert "base" not in frames


def test_frames_are_bounded() -> None:
    frames = Frames()
    for number in range(MAX_FRAMES):
        frames.put(f"f{number}", step("map", 0, 0, 0))
    with pytest.raises(FrameError, match="more than 5000 frames"):
        frames.put("one more", step("map", 0, 0, 0))
    frames.put("f0", step("map", 1, 0, 0))
    assert frames.place("f0", "map", NOW, S) == (1, 0, 0)


def test_a_sighting_waits_for_its_transform_and_no_longer() -> None:
    sightings = Sightings()
    frames = frames_of(early=step("map", 0, 0, 0), late=step("map", 0, 0, 0, stamp_ns=NOW - 1))
    sightings.see("early", "1", NOW, NOW)
    sightings.see("late", "2", NOW, NOW)  # its transform is from an earlier picture
    sightings.see("never", "3", NOW, NOW)
    assert sightings.come(frames) == [("1", "early")]
    sightings.end("early")
    assert sightings.come(frames) == []
    frames.put("late", step("map", 0, 0, 0))
    assert sightings.come(frames) == [("2", "late")]
    sightings.end("late")
    assert sightings.missed(NOW + WAIT_NS) == []
    sightings.see("never", "3", NOW + S, NOW + S)  # a second sighting starts no new wait
    assert sightings.missed(NOW + WAIT_NS + 1) == ["never"]
    assert sightings.missed(NOW + WAIT_NS + 1) == []
