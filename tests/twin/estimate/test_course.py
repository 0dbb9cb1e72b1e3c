"""How things go on after the last reading: five products that make the covariance, exactly."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lupin_twin.estimate import course
from lupin_twin.estimate.kernel import Hyper
from tests.support.estimates import hypers
from tests.support.textbook_gp import Spot, common


@given(hypers, st.floats(0.0, 48.0), st.floats(0.0, 48.0))
def test_a_reading_s_states_times_a_moment_s_shares_are_the_covariance(
    h: Hyper, age_h: float, later_h: float
) -> None:
    house, place = course.of_readings(h, np.array([age_h]))
    of_house, of_place = course.of_moments(h, np.array([later_h]))
    assert house.shape == place.shape == of_house.shape == of_place.shape == (1, course.STATES)
    reading = Spot(0.0, 0.0, -age_h)
    # Infinitely far from any tag there is the house's course alone.
    nowhere = common(reading, Spot(1e9, 0.0, later_h), h)
    assert house[0] @ of_house[0] == pytest.approx(nowhere, rel=1e-12)
    here = common(reading, Spot(0.0, 0.0, later_h), h) - nowhere
    assert place[0] @ of_place[0] == pytest.approx(here, rel=1e-9, abs=1e-12)
