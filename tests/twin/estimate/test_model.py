"""A model: fitted to readings, immutable, and its estimate equal to a textbook's."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lupin_twin.estimate.kernel import Hyper, Readings, Scale
from lupin_twin.estimate.model import Model, fit
from lupin_twin.estimate.posterior import INFLATION
from tests.support import textbook_gp
from tests.support.estimates import DAY_S, a_day, hypers, readings_of, some_readings, spots_of
from tests.support.textbook_gp import Spot

PLACES = [(0.0, 0.0), (1.3, -2.0), (-4.0, 4.5)]


def model_of(h: Hyper) -> Model:
    return Model(Scale(20.0, 2.0), DAY_S, h)


@given(some_readings(), hypers, st.floats(0.0, 12.0))
def test_the_estimate_is_the_textbook_s(readings: Readings, h: Hyper, later_h: float) -> None:
    at_hour = float(readings.time_s.max()) / 3600.0 + later_h
    mean, sd = model_of(h).posterior(readings, at_hour * 3600.0).points(np.array(PLACES))
    y = (readings.value - 20.0) / 2.0
    for index, place in enumerate(PLACES):
        middle, variance = textbook_gp.predicted(spots_of(readings), y, Spot(*place, at_hour), h)
        assert mean[index] == pytest.approx(20.0 + 2.0 * middle, abs=1e-6 * (1 + abs(middle)))
        wider = 4.0 * INFLATION**2 * variance
        assert sd[index] ** 2 == pytest.approx(wider, rel=1e-6, abs=1e-8)


@pytest.mark.parametrize(
    "rows",
    [
        [(1.0, 0, 22.0)],
        [(1.0, 0, 22.0)] * 5,
        [(1.0, 0, 22.0), (1.0, 1, 25.0), (1.0, 0, 19.0)],
        [(hour / 2.0, hour % 2, 22.0) for hour in range(20)],
    ],
)
def test_one_reading_or_duplicates_or_equal_values_make_a_model(
    rows: list[tuple[float, int, float]],
) -> None:
    readings = readings_of(rows, [(0.0, 0.0), (1.0, 1.0)])
    posterior = fit(readings).posterior(readings, DAY_S / 2)
    mean, sd = posterior.points(np.array(PLACES))
    assert np.isfinite(mean).all()
    assert (sd > 0.0).all()


def test_certainty_is_limited_by_the_variation_of_positions_and_readings() -> None:
    h = Hyper(1.0, 5.0, 1.0, 0.3, 0.0001, 8.0, 0.4, 2.5, 0.15, 1e-6)
    assert model_of(h).sd_known == pytest.approx(0.6 * INFLATION * 0.5 * 2.0, rel=1e-6)
    wild = h._replace(sa=100.0)
    assert model_of(wild).sd_known == 2.0


def test_the_daily_course_bridges_an_outage_only_with_the_right_length_of_the_day() -> None:
    day = a_day(passes=24)
    true = 21.0 + 4.0 * np.sin(2.0 * np.pi * 1.25) + 0.4 * day.xy[:, 1]
    reported = fit(day).posterior(day, 1.25 * DAY_S).points(day.xy)
    wrong = fit(day, day_length_s=60 * DAY_S)
    off = wrong.posterior(day, 1.25 * DAY_S).points(day.xy)
    assert np.abs(reported[0] - true).mean() < 0.3
    assert np.abs(off[0] - true).mean() > 1.0


@pytest.mark.parametrize("value", [3e38, -3e38, 1e-300])
@pytest.mark.parametrize("metres", [0.0, 1e300])
def test_extreme_numbers_give_an_estimate_or_an_error(value: float, metres: float) -> None:
    rows = [(hour / 2.0, hour % 2, value * (1 + hour % 3)) for hour in range(12)]
    readings = readings_of(rows, [(metres, -metres), (-metres, metres)])
    try:
        mean, sd = fit(readings).posterior(readings, DAY_S / 2).points(np.array(PLACES))
    except np.linalg.LinAlgError:
        return
    assert np.isfinite(mean).all()
    assert np.isfinite(sd).all()


def test_a_model_learns_from_few_readings_of_tags_and_hours_all_over() -> None:
    """With a hundred tags it finds the true length: some of the chosen ones are neighbours."""
    chance = np.random.default_rng(1)
    xy = chance.uniform(0.0, 30.0, (100, 2))
    time_s = np.sort(chance.uniform(0.0, DAY_S, 2_000))
    tag = np.tile(np.arange(100), 20)
    value = 20.0 + 3.0 * np.sin(0.9 * xy[tag, 0]) + np.sin(2.0 * np.pi * time_s / DAY_S)
    many = Readings(time_s, tag, value + chance.normal(0.0, 0.1, 2_000), xy)
    model = fit(many)
    assert model == fit(many), "the same ones every time"
    assert 0.8 < model.hyper.l < 6.0
    mean, sd = model.posterior(many.recent(DAY_S, per_tag=6), DAY_S).points(xy)
    true = 20.0 + 3.0 * np.sin(0.9 * xy[:, 0])
    assert (np.abs(mean - true) <= 1.645 * sd).mean() > 0.85
    assert sd.mean() < 1.0
