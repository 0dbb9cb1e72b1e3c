"""The small map of a site: as large at most, the worst on top, the map's own way up."""

import random

from lupin_bridge.fleet.overview import dots, map_svg, map_version
from lupin_bridge.judge.verdict import Health, Verdict
from lupin_twin.core.state import Pose, TagState


def drawn(*tags: tuple[float, float, Verdict]) -> str:
    states = [
        TagState(str(n), pose=Pose(x, y, 0.0, 0.0, 0.0, 0.0, 1.0))
        for n, (x, y, _) in enumerate(tags)
    ]
    return dots(states, {str(n): Health(verdict) for n, (_, _, verdict) in enumerate(tags)})


WELL, BAD = Verdict.HEALTHY, Verdict.CRITICAL


def test_y_grows_upwards_and_the_worst_is_drawn_last() -> None:
    assert drawn((0.0, 0.0, BAD), (4.0, 2.0, WELL)) == (
        '<path class="healthy" d="M40 0h0"/><path class="critical" d="M0 20h0"/>'
    )


def test_it_is_in_the_middle_and_as_wide_as_it_is_high() -> None:
    assert drawn((0.0, 0.0, WELL), (0.0, 5.0, WELL)) == (
        '<path class="healthy" d="M20 0h0M20 20h0"/>'
    )
    assert drawn((7.0, 3.0, WELL)) == '<path class="healthy" d="M20 10h0"/>'


def test_of_tags_at_one_place_the_worst_is_drawn() -> None:
    one = drawn((0.0, 0.0, WELL), (0.001, 0.0, BAD), (10.0, 0.0, WELL))
    assert one.count("M") == 2
    assert 'class="critical" d="M0 10h0"' in one


def test_ten_thousand_tags_are_no_more_than_seven_kb() -> None:
    chance = random.Random(1)
    many = [
        (chance.uniform(0, 100), chance.uniform(0, 60), chance.choice([WELL, BAD]))
        for _ in range(10_000)
    ]
    assert len(map_svg(drawn(*many))) < 7_500


def test_a_tag_that_is_far_off_leaves_the_others_as_they_are() -> None:
    near = [(float(n % 6), float(n // 6), WELL) for n in range(30)]
    assert drawn(*near, (5e5, 0.0, BAD)) == drawn(*near)


def test_a_tag_without_a_place_is_not_drawn_and_nothing_has_no_version() -> None:
    assert dots([TagState("a")], {"a": Health(WELL)}) == ""
    assert map_version("") is None
    assert map_version(drawn((0.0, 0.0, WELL))) != map_version(drawn((0.0, 0.0, BAD)))
