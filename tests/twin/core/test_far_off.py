"""Which tags are far off. `domain/twin.test.ts` checks the page with the same table."""

import json
import math
from pathlib import Path
from typing import Any

import pytest

from lupin_twin.core.parameters import FARTHEST_M
from lupin_twin.core.state import Observation, Pose, TwinStore
from lupin_twin.field.grid import far_off_tags, reach_of

CASES: dict[str, Any] = json.loads(
    Path(__file__).with_name("far_off.json").read_text(encoding="utf-8")
)


@pytest.mark.parametrize("case", CASES)
def test_the_cases_that_are_shared_with_the_page(case: str) -> None:
    at = [(float(x), float(y)) for x, y in CASES[case]["at"]]
    reach = reach_of(at)
    assert [index for index, place in enumerate(at) if not reach.holds(*place)] == (
        CASES[case]["far"]
    )


def test_without_tags_every_valid_pose_is_on_the_map() -> None:
    reach = reach_of([])
    assert reach.holds(FARTHEST_M, -FARTHEST_M)
    assert not reach.holds(math.nextafter(FARTHEST_M, math.inf), 0.0)


def test_tags_are_named_and_those_without_a_pose_are_not_far_off() -> None:
    store = TwinStore()
    for index, x in enumerate((0.0, 1.0, 2.0, 5000.0)):
        store.record(
            Observation(f"tag {index}", 1, {"co2": 1.0}, Pose(x, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0))
        )
    store.record(Observation("nowhere", 1, {"co2": 1.0}))
    assert far_off_tags(store.snapshot(1, "map").tags) == ["tag 3"]
