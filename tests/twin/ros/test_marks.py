"""The marks of tags and planters: position, once each, and the colour of their age."""

import pytest

from lupin_twin.core.state import NO_FLOWER, Flower, Pose, Snapshot, TagState
from lupin_twin.ros.layers import FRESH_S, OLD_S, appearance_of, planter_marks

NOW_NS = 10_000_000_000_000
BOX = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 0.5, 0.0))


def tag(name: str, age_s: float = 0.0, flower: Flower = NO_FLOWER) -> TagState:
    observed_ns = NOW_NS - round(age_s * 1e9)
    return TagState(name, Pose.at(0.0, 2.0, 0.5), last_observed_ns=observed_ns, flower=flower)


@pytest.mark.parametrize(
    ("age_s", "look"),
    [
        (0.0, "fresh"),
        (FRESH_S - 1e-3, "fresh"),
        (FRESH_S, "fading"),
        (OLD_S - 1e-3, "fading"),
        (OLD_S, "old"),
    ],
)
def test_a_tags_mark_shows_its_age(age_s: float, look: str) -> None:
    assert appearance_of(tag("a", age_s=age_s), NOW_NS) == look


def test_a_planter_is_marked_once_with_the_number_of_its_first_tag() -> None:
    seen = Flower(footprint=BOX)
    others = Flower(footprint=((5.0, 0.0, 0.0), *BOX[1:]))
    marks = planter_marks(
        Snapshot(
            NOW_NS,
            "map",
            (tag("bare"), tag("a", flower=seen), tag("b", flower=others), tag("c", flower=seen)),
        )
    )
    outlines = [(1, (*BOX, BOX[0])), (2, (*others.footprint, others.footprint[0]))]
    assert [(mark.number, mark.points) for mark in marks] == outlines
