"""Each of many tags brought to one moment: held against all readings reckoned with at once."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from lupin_twin.estimate import Readings
from lupin_twin.estimate.kernel import PRIOR_MEDIAN, UNKNOWN_MEAN, pairs_of
from lupin_twin.estimate.member import members_of
from lupin_twin.estimate.nowcast import nowcasts
from lupin_twin.grid import FloatArray
from lupin_twin.idw import Abandoned
from tests.support.estimates import DAY_S, many_tags, some_readings

H = PRIOR_MEDIAN


def ages_h(readings: Readings, later_h: float = 0.0) -> FloatArray:
    result: FloatArray = (readings.time_s.max() - readings.time_s) / 3600.0 + later_h
    return result


@pytest.mark.parametrize("later_h", [0.0, 6.0])
def test_of_tags_far_from_each_other_it_is_what_all_readings_say(later_h: float) -> None:
    """Then nothing but the house's course hangs together, and that is reckoned with at once."""
    readings = many_tags(40, 5, 1_000.0)
    now = nowcasts(H, readings, readings.value, ages_h(readings, later_h))
    (exact,) = members_of([H], pairs_of(readings, DAY_S), readings.value, later_h)
    mean, variance = exact.moments(exact.near(readings.xy, readings.xy))
    # A pseudo-reading alone, with the house's level as unknown as ever, says the same of its tag.
    before = UNKNOWN_MEAN + H.local_variance
    share = before / (before + now.noise)
    sd = np.sqrt(variance)
    assert np.abs(share * now.value - mean).max() < 0.35 * sd.min()
    assert np.sqrt(before * (1.0 - share) + now.drift) == pytest.approx(sd, rel=0.1)


@settings(max_examples=50)
@example(many_tags(2, 1, 1.0).take(np.array([0])), 5e-324)
@given(some_readings(), st.floats(0.0, 30.0))
def test_whatever_was_read_it_is_a_number_with_noise(readings: Readings, later_h: float) -> None:
    now = nowcasts(H, readings, readings.value, ages_h(readings, later_h))
    assert len(now.xy) == len(now.value) == len(now.noise) == len(np.unique(readings.tag))
    assert np.isfinite(now.value).all()
    assert (now.noise > 0.0).all()
    assert now.drift >= 0.0


def test_what_the_house_does_unheard_grows_and_is_common_to_all() -> None:
    readings = many_tags(30, 5, 20.0)
    drifts = [
        nowcasts(H, readings, readings.value, ages_h(readings, later_h)).drift
        for later_h in (0.0, 1.0, 6.0)
    ]
    assert drifts == sorted(drifts)
    assert drifts[0] < 0.02
    assert drifts[2] > 0.5


def test_tags_with_more_readings_and_with_fewer_keep_their_order() -> None:
    readings = many_tags(20, 4, 20.0)
    fewer = readings.take((readings.tag != 3) | (readings.time_s > 2.0 * 2_700.0))
    fewer = fewer.take(fewer.tag != 7)
    now = nowcasts(H, fewer, fewer.value, ages_h(fewer))
    assert now.xy.tolist() == np.delete(readings.xy, 7, axis=0).tolist()
    all_of = nowcasts(H, readings, readings.value, ages_h(readings))
    assert np.delete(all_of.value, 7) == pytest.approx(now.value, abs=0.3)
    assert now.noise[3] > all_of.noise[3]


def test_who_is_not_waited_for_ends() -> None:
    readings = many_tags(20, 4, 20.0)
    with pytest.raises(Abandoned):
        nowcasts(H, readings, readings.value, ages_h(readings), lambda: True)
