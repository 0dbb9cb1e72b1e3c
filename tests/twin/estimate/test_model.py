"""The model by the textbook: its fit, its numbers, and its grid."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lupin_twin.estimate.kernel import (
    PRIOR_LOG_SD,
    PRIOR_MEDIAN,
    Hyper,
    Pairs,
    Readings,
    Scale,
    scale_of,
)
from lupin_twin.estimate.model import Model, fit, hyper_of, minimise, negative_log_posterior
from lupin_twin.estimate.posterior import EstimateGrid, Posterior, lattice
from lupin_twin.estimate.solution import INFLATION, MAX_EXACT
from lupin_twin.field.grid import FloatArray, cell_centres
from lupin_twin.field.idw import Abandoned
from tests.support import textbook_gp
from tests.support.estimates import (
    DAY_S,
    a_day,
    hypers,
    readings_of,
    some_readings,
    spot_at,
    spots_of,
)
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


BOX = {"bbox_min_x": 0.0, "bbox_min_y": 0.0, "bbox_max_x": 4.0, "bbox_max_y": 8.0}


@pytest.mark.parametrize(("resolution", "tags"), [(0.5, 8), (0.5, 30)])
def test_a_grid_holds_the_centres_of_its_cells(resolution: float, tags: int) -> None:
    day = a_day(tags=tags, passes=4)
    posterior = fit(day).posterior(day, DAY_S)
    grid = posterior.grid(**BOX, resolution=resolution)
    assert grid.mean.shape == grid.sd.shape == grid.known.shape == (grid.height, grid.width)
    mean, sd, x, y = beside(posterior, grid)
    assert grid.mean[y, x] == pytest.approx(mean, rel=1e-5)
    assert grid.sd[y, x] == pytest.approx(sd, rel=1e-5)
    assert (grid.known == (grid.sd < grid.sd_known)).all()


@pytest.mark.parametrize("length", [0.4, 1.0, 3.0])
def test_a_fine_grid_is_interpolated_with_a_small_error(length: float) -> None:
    """However short the true length is: the lattice adapts to it."""
    day = a_day(tags=30, passes=6)
    model = fit(day)
    model = replace(model, hyper=model.hyper._replace(l=length))
    posterior = model.posterior(day, DAY_S)
    grid = posterior.grid(**BOX, resolution=0.02)
    mean, sd, x, y = beside(posterior, grid)
    assert (np.abs(grid.mean[y, x] - mean) <= 0.1 * sd).all()
    assert grid.sd[y, x] == pytest.approx(sd, rel=0.15)
    assert not (np.abs(grid.mean[y, x] - mean) < 1e-7).all(), "this was not interpolated"


@pytest.mark.parametrize("side_m", [8.0, 100.0, 1_000.0])
@pytest.mark.parametrize("length", [0.4, 3.0])
def test_a_lattice_is_never_coarser_than_a_fifth_of_the_length(
    side_m: float, length: float
) -> None:
    cell_m = side_m / 2_000
    cells = cell_centres(0.0, 2_000, cell_m)
    x, y = lattice((cells, cells), cell_m, length)
    assert max(np.diff(x).max(), np.diff(y).max()) <= max(length / 5.0, cell_m) + 1e-9


def beside(posterior: Posterior, grid: EstimateGrid) -> tuple[FloatArray, FloatArray, Any, Any]:
    """Mean and sd at the centres of some cells, and these cells."""
    chosen = np.random.default_rng(1).integers((grid.width, grid.height), size=(300, 2))
    centres = (chosen.astype(np.float64) + 0.5) * grid.resolution
    centres += (grid.origin_x, grid.origin_y)
    x, y = chosen.T
    return (*posterior.points(centres), x, y)


def test_beyond_the_limit_of_readings_the_nearest_ones_give_nearly_the_same() -> None:
    chance = np.random.default_rng(3)
    xy = chance.uniform(0.0, 12.0, (200, 2))
    tag = np.concatenate([chance.permutation(200) for _ in range(6)])
    time_s = np.sort(chance.uniform(0.0, DAY_S, len(tag)))
    warm = 20.0 + np.sin(0.8 * xy[tag, 0]) + 2.0 * np.sin(2.0 * np.pi * time_s / DAY_S)
    many = Readings(time_s, tag, warm + chance.normal(0.0, 0.2, len(tag)), xy)
    assert len(many) > MAX_EXACT
    model = fit(many)
    near = model.posterior(many, DAY_S)
    places = chance.uniform(0.0, 12.0, (200, 2))
    mean, sd = near.points(places)
    y, h = (many.value - model.scale.centre) / model.scale.spread, model.hyper
    spots = spots_of(many)
    covariance = Pairs(many, DAY_S).covariance(h)
    shared = np.array(
        [[textbook_gp.common(spot_at(place, 24.0), one, h) for one in spots] for place in places]
    )
    weights = np.linalg.solve(covariance, shared.T).T
    prior = h.common_variance + h.local_variance
    exact = weights @ y * model.scale.spread + model.scale.centre
    exact_sd = np.sqrt(prior - (weights * shared).sum(axis=1)) * model.scale.spread * INFLATION
    off = np.abs(mean - exact) / exact_sd
    assert off.max() < 1.0
    assert off.mean() < 0.3
    assert 0.9 < (sd / exact_sd).min() <= (sd / exact_sd).max() < 1.5
    grid = near.grid(bbox_min_x=0, bbox_min_y=0, bbox_max_x=12, bbox_max_y=12, resolution=0.5)
    centres = np.stack(np.meshgrid(*[(np.arange(24) + 0.5) / 2.0] * 2), axis=-1)
    assert grid.mean == pytest.approx(near.points(centres)[0].reshape(24, 24), rel=1e-5)


@pytest.mark.parametrize("tags", [8, MAX_EXACT])
def test_a_cancelled_estimate_ends_soon(tags: int) -> None:
    day = a_day(tags=tags, passes=2)
    is_over = False
    posterior = fit(day).posterior(day, DAY_S, lambda: is_over)
    posterior.points(np.array(PLACES))
    is_over = True
    for query in (lambda: posterior.points(np.array(PLACES)), posterior.changes):
        with pytest.raises(Abandoned):
            query()
    with pytest.raises(Abandoned):
        fit(day, should_stop=lambda: True)


START = np.zeros(len(PRIOR_MEDIAN))


def objective_of(readings: Readings) -> Any:
    y = scale_of(readings.value).standardised(readings.value)
    return negative_log_posterior(Pairs(readings, DAY_S), y)


@given(some_readings())
def test_the_objective_is_minus_the_log_of_likelihood_and_prior(readings: Readings) -> None:
    y = scale_of(readings.value).standardised(readings.value)
    there = np.linspace(-0.5, 0.5, len(START))

    def plainly(coordinates: Any) -> float:
        h = hyper_of(coordinates)
        likelihood = textbook_gp.log_likelihood(spots_of(readings), y, h)
        return -likelihood - textbook_gp.log_prior(h, PRIOR_MEDIAN, PRIOR_LOG_SD)

    objective = objective_of(readings)
    found = objective(there)[0] - objective(START)[0]
    assert found == pytest.approx(plainly(there) - plainly(START), rel=1e-6, abs=1e-6)


@settings(max_examples=30)
@given(some_readings())
def test_its_gradient_equals_finite_differences(readings: Readings) -> None:
    objective = objective_of(readings)
    there = np.linspace(0.4, -0.4, len(START))
    step = 1e-5
    expected = [
        (objective(there + step * axis)[0] - objective(there - step * axis)[0]) / (2.0 * step)
        for axis in np.eye(len(there))
    ]
    scale = 1.0 + np.abs(expected).max()
    assert objective(there)[1] == pytest.approx(expected, rel=1e-4, abs=1e-5 * scale)


def test_a_matrix_that_cannot_be_factorised_has_no_density_and_ends_no_search() -> None:
    def steep(at: Any) -> tuple[float, Any]:
        if at[0] > 0.5:
            return np.inf, at
        return float((at[0] - 2.0) ** 2), np.array([2.0 * (at[0] - 2.0)])

    assert minimise(steep, np.zeros(1))[0] == pytest.approx(0.5, abs=0.1)
    with pytest.raises(np.linalg.LinAlgError, match="singular at the prior's own median"):
        minimise(lambda at: (np.inf, at), START)
