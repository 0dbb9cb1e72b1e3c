"""The error of a field, by leaving out each tag once, and how much of it is known."""

import math
import tracemalloc
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lupin_twin.core.state import Pose, Reading, TagState
from lupin_twin.field import idw
from lupin_twin.field.engine import FieldQuality, leave_one_out, painted_share
from lupin_twin.field.idw import Abandoned, compute_idw_field
from tests.oracle_idw import value_at

RULES: dict[str, Any] = {"falloff_radius_m": 1.5, "max_distance_m": 1.5, "power": 2.0}

Spot = tuple[float, float, float]


def tag(tag_id: str, x: float, y: float, value: float) -> TagState:
    return TagState(
        tag_id=tag_id,
        pose=Pose(x, y, 0.5, 0.0, 0.0, 0.0, 1.0),
        readings=(Reading("humidity", 55.0), Reading("temperature", value)),
    )


def tags_at(spots: Iterable[Spot]) -> list[TagState]:
    return [tag(f"tag-{index}", *spot) for index, spot in enumerate(spots)]


def quality_of(spots: Sequence[Spot], **changes: Any) -> FieldQuality:
    return leave_one_out(tags_at(spots), "temperature", **{**RULES, **changes})


def test_lonely_tags_give_no_error() -> None:
    for spots in ([], [(0.0, 0.0, 10.0)], [(0.0, 0.0, 10.0), (9.0, 0.0, 10.0)]):
        assert quality_of(spots) == FieldQuality(0, len(spots), None, None)


def test_only_pinned_tags_with_a_finite_reading_of_the_sensor_take_part() -> None:
    tags = [
        *tags_at([(0.0, 0.0, 10.0), (1.0, 0.0, 12.0), (0.5, 0.0, math.nan)]),
        TagState("unpinned", readings=(Reading("temperature", 90.0),)),
        TagState("silent", pose=Pose(0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)),
    ]
    quality = leave_one_out(tags, "temperature", **RULES)
    assert (quality.judged, quality.unjudged, quality.rmse) == (2, 0, 2.0)
    assert leave_one_out(tags, "light", **RULES) == FieldQuality(0, 0, None, None)


@settings(max_examples=150)
@given(
    spots=st.lists(
        st.tuples(
            st.integers(0, 16).map(lambda number: number / 4),
            st.floats(0.0, 4.0),
            st.floats(-50.0, 50.0),
        ),
        max_size=25,
    ),
    falloff=st.sampled_from([0.5, 1.5, 3.0]),
    max_distance=st.sampled_from([0.5, 1.5, 3.0]),
    power=st.sampled_from([2.0, 3.0]),
)
def test_the_error_matches_its_definition(
    spots: list[Spot], falloff: float, max_distance: float, power: float
) -> None:
    rules = {"falloff_radius_m": falloff, "max_distance_m": max_distance, "power": power}
    with pytest.MonkeyPatch.context() as patch:  # in many parts
        patch.setattr(idw, "MAX_PAIRS", 16)
        patch.setattr(idw, "MIN_POINTS", 1)
        quality = quality_of(spots, **rules)
    errors = [
        value_at((x, y), [*spots[:index], *spots[index + 1 :]], **rules) - value
        for index, (x, y, value) in enumerate(spots)
    ]
    known = [error for error in errors if not math.isnan(error)]
    assert (quality.judged, quality.unjudged) == (len(known), len(spots) - len(known))
    if known:
        expected = math.sqrt(sum(error**2 for error in known) / len(known))
        assert quality.rmse == pytest.approx(expected, rel=1e-9, abs=1e-9)
        assert quality.worst is not None
        assert abs(quality.worst.error) == pytest.approx(max(map(abs, known)), abs=1e-9)
        index = int(quality.worst.tag_id.removeprefix("tag-"))
        assert quality.worst.error == pytest.approx(errors[index], abs=1e-9)
        assert quality.worst.measured == spots[index][2]
        assert quality.worst.predicted == pytest.approx(errors[index] + spots[index][2], abs=1e-9)


def test_memory_does_not_grow_with_the_square_of_the_tags() -> None:
    rng = np.random.default_rng(1)
    spots = rng.uniform(0.0, 40.0, (4000, 2)).tolist()
    tags = tags_at((x, y, x + y) for x, y in spots)
    tracemalloc.start()
    try:
        quality = leave_one_out(tags, "temperature", **RULES)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert quality.judged == 4000
    assert peak < 4_000_000  # the square of the tags is 128 MB of distances


def test_the_painted_share_is_that_of_the_known_cells() -> None:
    samples = [(0.5, 0.5, 1.0), (1.5, 0.5, 1e39)]
    grid = compute_idw_field(
        samples,
        bbox_min_x=0.0,
        bbox_min_y=0.0,
        bbox_max_x=4.0,
        bbox_max_y=2.0,
        resolution=1.0,
        falloff_radius_m=0.5,
        max_distance_m=0.5,
        power=2.0,
    )
    assert painted_share(grid) == 0.25


def test_a_cancelled_judgement_ends_between_two_parts() -> None:
    answers = iter([False, False, True])
    spots = [(x * 0.5, y * 0.5, 1.0) for x in range(40) for y in range(40)]
    with pytest.raises(Abandoned):
        quality_of(spots, should_stop=lambda: next(answers))
    assert next(answers, None) is None, "checked three times, and not again"
