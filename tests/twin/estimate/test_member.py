"""What one set of parameters makes of the readings, now, later and of two places at once."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lupin_twin.estimate import Readings
from lupin_twin.estimate.kernel import Hyper, pairs_of
from lupin_twin.estimate.member import members_of
from tests.support import textbook_gp
from tests.support.estimates import DAY_S, hypers, some_readings, spot_at, spots_of

PLACES = np.array([(0.0, 0.0), (1.3, -2.0), (-4.0, 4.5)])


@given(some_readings(), hypers, st.floats(0.0, 12.0), st.floats(0.0, 12.0))
def test_now_and_later_are_the_textbook_s_and_a_reading_has_noise(
    readings: Readings, h: Hyper, now_h: float, later_h: float
) -> None:
    y = readings.value / 10.0
    (member,) = members_of([h], pairs_of(readings, DAY_S), y, now_h)
    newest_h = float(readings.time_s.max()) / 3600.0
    phi = member.near(PLACES, readings.xy)
    now = member.moments(phi)
    later = member.moments_later(phi, np.full(len(PLACES), later_h))
    assert member.noise == h.tau**2 + 0.02**2
    for index, place in enumerate(PLACES):
        for hour, (mean, variance), noise in (
            (newest_h + now_h, now, 0.0),
            (newest_h + later_h, later, member.noise),
        ):
            spot = spot_at(place, hour)
            expected, of_true = textbook_gp.foretold(spots_of(readings), y, spot, h)
            assert mean[index] == pytest.approx(expected, abs=1e-6 * (1.0 + abs(expected)))
            assert variance[index] == pytest.approx(of_true + noise, rel=1e-6, abs=1e-8)


@given(some_readings(), hypers)
def test_what_two_places_share_is_the_textbook_s(readings: Readings, h: Hyper) -> None:
    (member,) = members_of([h], pairs_of(readings, DAY_S), readings.value, 0.0)
    phi = member.near(PLACES, readings.xy)
    found = member.shared(phi, phi, member.nearness(PLACES, PLACES))
    at_h = float(readings.time_s.max()) / 3600.0
    now = [spot_at(place, at_h) for place in PLACES]
    spots = [*spots_of(readings), *now]
    block = list(range(len(readings), len(spots)))
    _, covariance = textbook_gp.left_out(spots, np.zeros(len(spots)), block, h)
    expected = covariance - np.eye(len(PLACES)) * member.noise
    assert found == pytest.approx(expected, rel=1e-6, abs=1e-6)
    assert np.diagonal(found) == pytest.approx(member.moments(phi)[1], rel=1e-9, abs=1e-9)
