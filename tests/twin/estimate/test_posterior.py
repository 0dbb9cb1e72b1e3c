"""The estimate as of a moment: at points and on grids, from few readings and from many."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lupin_twin.estimate.kernel import Pairs, Readings
from lupin_twin.estimate.model import fit
from lupin_twin.estimate.posterior import INFLATION, Cells, EstimateGrid, Posterior
from lupin_twin.estimate.solution import MAX_EXACT
from lupin_twin.field.grid import FloatArray
from lupin_twin.field.idw import Abandoned
from tests.support import textbook_gp
from tests.support.estimates import DAY_S, a_day, spot_at, spots_of

PLACES = np.array([(0.0, 0.0), (1.3, -2.0), (-4.0, 4.5)])
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
    x, y = Cells.of(0.0, 0.0, side_m, side_m, side_m / 2_000).lattice(length)
    assert max(np.diff(x).max(), np.diff(y).max()) <= max(length / 5.0, side_m / 2_000) + 1e-9


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
    posterior.points(PLACES)
    is_over = True
    for query in (lambda: posterior.points(PLACES), posterior.changes):
        with pytest.raises(Abandoned):
            query()
    with pytest.raises(Abandoned):
        fit(day, should_stop=lambda: True)
