"""The estimate of many tags: close to the exact one, and the same questions answered."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from lupin_twin.estimate import (
    MAX_EXACT,
    Model,
    Nearby,
    Posterior,
    Readings,
    TiledPosterior,
    fit,
    screen,
)
from lupin_twin.estimate.kernel import HOURS, pairs_of
from lupin_twin.estimate.member import members_of
from lupin_twin.grid import FloatArray
from lupin_twin.idw import Abandoned
from tests.support.estimates import DAY_S, many_tags

METRES = 12.0
MANY = many_tags(120, 6, METRES)
NEWEST_S = float(MANY.time_s.max())
MODEL = fit(Nearby(MANY).some(300))
BOX = {"bbox_min_x": 0.0, "bbox_min_y": 0.0, "bbox_max_x": METRES, "bbox_max_y": METRES}
PLACES: FloatArray = np.random.default_rng(1).uniform(0.0, METRES, (1_000, 2))


def exactly(model: Model, readings: Readings, at_s: float) -> Posterior:
    later_h = (at_s - readings.time_s.max()) * HOURS / DAY_S
    y = model.scale.standardised(readings.value)
    h = model.most_probable
    members = members_of([h], pairs_of(readings, DAY_S), y, later_h)
    return Posterior(model.scale, model.sd_known, DAY_S, h, readings, members)


def test_up_to_sixty_four_tags_it_is_exact_and_of_one_more_by_what_is_near() -> None:
    few = MANY.take(MANY.tag < MAX_EXACT)
    assert isinstance(MODEL.posterior(few, NEWEST_S), Posterior)
    more = MANY.take(MANY.tag <= MAX_EXACT)
    assert isinstance(MODEL.posterior(more, NEWEST_S), TiledPosterior)


@pytest.mark.parametrize("later_h", [0.0, 6.0])
def test_mean_and_sd_are_close_to_those_of_all_readings_at_once(later_h: float) -> None:
    at_s = NEWEST_S + later_h * 3600.0
    mean, sd = MODEL.posterior(MANY, at_s).points(PLACES)
    expected, expected_sd = exactly(MODEL, MANY, at_s).points(PLACES)
    off = np.abs(mean - expected) / expected_sd
    assert np.sqrt(np.mean(off**2)) < 0.4
    assert off.max() < 1.5
    assert 0.9 < np.median(sd / expected_sd) < 1.25
    assert (sd / expected_sd).min() > 0.85


@pytest.mark.parametrize("resolution", [0.5, 0.05])
def test_a_grid_is_its_cells_centres(resolution: float) -> None:
    posterior = MODEL.posterior(MANY, NEWEST_S)
    grid = posterior.grid(**BOX, resolution=resolution)
    assert grid.mean.dtype == grid.sd.dtype == np.float32
    assert grid.mean.shape == grid.sd.shape == grid.known.shape == (grid.height, grid.width)
    chosen = np.random.default_rng(2).integers((grid.width, grid.height), size=(200, 2))
    mean, sd = posterior.points((chosen.astype(np.float64) + 0.5) * resolution)
    x, y = chosen.T
    is_by_lattice = resolution < 0.1
    assert grid.mean[y, x] == pytest.approx(mean, abs=0.05 * sd.min() if is_by_lattice else 1e-4)
    assert grid.sd[y, x] == pytest.approx(sd, rel=0.15 if is_by_lattice else 1e-3)
    assert (grid.known == (grid.sd < grid.sd_known)).all()


def test_a_reading_is_foretold_by_those_near_it() -> None:
    posterior = MODEL.posterior(MANY, NEWEST_S)
    times_s = np.full(5, NEWEST_S + 1_800.0)
    mean, sd = posterior.foretell(PLACES[:5], times_s)
    expected, expected_sd = exactly(MODEL, MANY, NEWEST_S).foretell(PLACES[:5], times_s)
    assert (np.abs(mean - expected) < 0.5 * expected_sd).all()
    assert sd == pytest.approx(expected_sd, rel=0.2)
    with pytest.raises(ValueError, match="before the newest reading"):
        posterior.foretell(PLACES[:1], np.array([NEWEST_S - 1.0]))


def test_the_one_that_has_changed_is_found_among_many() -> None:
    value = MANY.value.copy()
    value[np.flatnonzero(MANY.tag == 77)[-3:]] += 3.0
    changed = Readings(MANY.time_s, MANY.tag, value, MANY.xy)
    posterior = MODEL.posterior(changed, NEWEST_S)
    changes, expected = posterior.changes(), posterior.expected()
    assert len(changes) == len(expected) == 120
    assert max(range(120), key=lambda tag: abs(change.z) if (change := changes[tag]) else 0.0) == 77
    of_it = expected[77]
    assert of_it is not None
    assert value[MANY.tag == 77][-1] - of_it.mean == pytest.approx(3.0, abs=1.0)
    screening = screen(MODEL, changed)
    assert list(screening.changed) == [77]
    assert len(screening.readings) == len(MANY) - 6
    assert list(screen(MODEL, changed, screening.changed).changed) == [77]
    assert screen(MODEL, MANY, screening.changed).changed == {}


def test_another_tag_helps_where_there_is_none() -> None:
    hole = MANY.take(np.square(MANY.xy[MANY.tag] - 6.0).sum(axis=1) > 9.0)
    assert len(np.unique(hole.tag)) > MAX_EXACT
    posterior = MODEL.posterior(hole, NEWEST_S)
    side = np.linspace(1.0, 11.0, 6)
    places = np.array([(x, y) for x in side for y in side])
    advice = posterior.advice(places, 3, over=places)
    assert np.hypot(advice[0].x - 6.0, advice[0].y - 6.0) < 2.0
    ratios = [place.error_ratio for place in advice]
    assert ratios == sorted(ratios, reverse=True)
    assert 0.3 < ratios[0] < 1.0
    assert len({(place.x, place.y) for place in advice}) == 3
    with pytest.raises(ValueError, match="nowhere"):
        posterior.advice(places, 1, over=np.empty((0, 2)))


@pytest.mark.parametrize(
    "question",
    [
        lambda posterior: posterior.grid(**BOX, resolution=0.5),
        lambda posterior: posterior.points(PLACES),
        lambda posterior: posterior.changes(),
        lambda posterior: posterior.foretell(PLACES[:1], np.array([NEWEST_S])),
        lambda posterior: posterior.advice(PLACES[:2], 1, over=PLACES[:2]),
    ],
)
def test_who_is_not_waited_for_ends(question: Callable[[object], object]) -> None:
    posterior = MODEL.posterior(MANY, NEWEST_S, lambda: True)
    with pytest.raises(Abandoned):
        question(posterior)
