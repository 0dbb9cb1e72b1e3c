"""Of many tags those near a place, their last readings, and the newest of the whole house."""

from __future__ import annotations

import numpy as np
import pytest

from lupin_twin.estimate import LAST, Nearby
from lupin_twin.estimate.nearby import TOGETHER
from tests.support.estimates import many_tags

MANY = many_tags(150, 10, 20.0)


def test_every_tag_with_readings_is_judged_once_with_its_last_readings() -> None:
    some = MANY.take(MANY.tag != 5)
    judged: list[int] = []
    for near in Nearby(some).all():
        assert len(near.judged) <= TOGETHER
        assert len(near.readings) <= 352
        numbers = near.tags[near.judged].tolist()
        judged += numbers
        for row, number in zip(near.judged, numbers, strict=True):
            assert near.readings.xy[row].tolist() == MANY.xy[number].tolist()
            own = np.sort(some.time_s[some.tag == number])[-LAST:]
            assert np.isin(own, near.readings.time_s[near.readings.tag == row]).all()
        assert np.isin(np.sort(some.time_s)[-64:], near.readings.time_s).all()
    assert sorted(judged) == [tag for tag in range(150) if tag != 5]


def test_about_a_place_are_the_tags_nearest_to_it() -> None:
    near = Nearby(MANY).at(np.array([10.0, 10.0]))
    assert not len(near.judged)
    far = np.square(MANY.xy - 10.0).sum(axis=1)
    assert np.isin(np.argsort(far)[:24], near.tags).all()


@pytest.mark.parametrize("tags", [1, 12, 13])
def test_few_tags_are_all_near(tags: int) -> None:
    readings = many_tags(tags, 3, 5.0)
    groups = list(Nearby(readings).all())
    assert len(groups) == (1 if tags <= TOGETHER else 2)
    assert all(len(near.tags) == tags for near in groups)


def test_some_of_the_readings_are_of_whole_groups_all_over_the_house() -> None:
    some = Nearby(MANY).some(400)
    assert 250 <= len(some) <= 500
    assert len(some.xy) == len(np.unique(some.tag))
    assert (np.bincount(some.tag) == LAST).all()
    assert np.ptp(some.xy, axis=0).min() > 12.0
