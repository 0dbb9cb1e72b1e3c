"""Where another tag helps most: the same as trying each candidate with the textbook formula."""

from math import sqrt

import numpy as np
import pytest
from hypothesis import given, settings

from lupin_twin.estimate.kernel import Hyper, Readings, Scale
from lupin_twin.estimate.model import Model, fit
from tests.support import textbook_gp
from tests.support.estimates import DAY_S, a_day, hypers, some_readings, spot_at, spots_of

CANDIDATES = np.array([(0.0, 0.0), (1.3, -2.0), (-4.0, 4.5), (9.0, 9.0)])
TARGETS = np.array([(0.5, 0.5), (-3.0, 2.0), (8.0, 8.0)])


def error_by_the_textbook(readings: Readings, h: Hyper, more: list[int]) -> float:
    """The root of the mean variance at the targets, with readings now at some candidates."""
    at_h = float(readings.time_s.max()) / 3600.0
    spots = spots_of(readings) + [spot_at(CANDIDATES[one], at_h) for one in more]
    nothing = np.zeros(len(spots))
    each = [textbook_gp.predicted(spots, nothing, spot_at(place, at_h), h)[1] for place in TARGETS]
    return sqrt(sum(each) / len(each))


@settings(max_examples=40)
@given(some_readings(), hypers)
def test_each_position_is_the_best_one_left_and_its_error_is_the_textbooks(
    readings: Readings, h: Hyper
) -> None:
    model = Model(Scale(20.0, 2.0), DAY_S, h)
    posterior = model.posterior(readings, float(readings.time_s.max()))
    advice = posterior.advice(CANDIDATES, 3, over=TARGETS)
    at_first = error_by_the_textbook(readings, h, [])
    taken: list[int] = []
    for place in advice:
        left = [one for one in range(len(CANDIDATES)) if one not in taken]
        best = min(error_by_the_textbook(readings, h, [*taken, one]) for one in left)
        chosen = CANDIDATES.tolist().index([place.x, place.y])
        assert chosen in left
        taken.append(chosen)
        error = error_by_the_textbook(readings, h, taken)
        assert error == pytest.approx(best, rel=1e-6)
        assert place.error_ratio == pytest.approx(error / at_first, rel=1e-6)


def test_no_candidates_give_no_advice() -> None:
    day = a_day(tags=3, passes=2)
    posterior = fit(day).posterior(day, DAY_S)
    assert posterior.advice(TARGETS, 0, over=TARGETS) == []
    assert posterior.advice(np.empty((0, 2)), 5, over=TARGETS) == []
