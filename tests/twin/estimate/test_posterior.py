"""The estimate as of a moment: on points and grids, how sure it is, and which tag has changed."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lupin_twin.estimate import Model, Readings, fit
from lupin_twin.estimate.kernel import Hyper
from lupin_twin.estimate.readings import Scale
from lupin_twin.grid import FloatArray
from tests.support import textbook_gp
from tests.support.estimates import DAY_S, a_day, hypers, some_readings, spot_at, spots_of

PLACES = np.array([(0.0, 0.0), (1.3, -2.0), (-4.0, 4.5)])
BOX = {"bbox_min_x": 0.0, "bbox_min_y": 0.0, "bbox_max_x": 4.0, "bbox_max_y": 8.0}


def variance(h: Hyper, readings: Readings) -> FloatArray:
    model = Model(Scale(0.0, 1.0), 1.0, DAY_S, h, (h,))
    _, sd = model.posterior(readings, DAY_S).points(PLACES)
    result: FloatArray = sd**2
    return result


@given(some_readings(), hypers)
def test_the_variance_is_never_negative_and_never_above_the_prior_s(
    readings: Readings, h: Hyper
) -> None:
    found = variance(h, readings)
    assert (found >= 0.0).all()
    assert (found <= h.prior_variance).all()


@given(some_readings(), hypers, st.data())
def test_the_variance_never_grows_with_a_new_reading(
    readings: Readings, h: Hyper, data: st.DataObject
) -> None:
    without = data.draw(st.integers(0, len(readings) - 1))
    fewer = readings.take(np.delete(np.arange(len(readings)), without))
    if len(fewer):
        assert (variance(h, readings) <= variance(h, fewer) + 1e-9).all()


@pytest.mark.parametrize(("resolution", "tags"), [(0.5, 8), (0.25, 30), (0.04, 3)])
def test_a_grid_is_its_cells_centres(resolution: float, tags: int) -> None:
    day = a_day(tags=tags, passes=4)
    posterior = fit(day, ideal=(18.0, 26.0)).posterior(day, DAY_S)
    grid = posterior.grid(**BOX, resolution=resolution)
    assert grid.mean.shape == grid.sd.shape == grid.known.shape == (grid.height, grid.width)
    chosen = np.random.default_rng(1).integers((grid.width, grid.height), size=(50, 2))
    centres = (chosen.astype(np.float64) + 0.5) * resolution
    mean, sd = posterior.points(centres)
    x, y = chosen.T
    assert grid.mean[y, x] == pytest.approx(mean, rel=1e-5)
    assert grid.sd[y, x] == pytest.approx(sd, rel=1e-5)
    assert (grid.known == (grid.sd < grid.sd_known)).all()


def test_by_lattice_it_is_off_by_little() -> None:
    day = a_day(tags=30, passes=6)
    posterior = fit(day, ideal=(18.0, 26.0)).posterior(day, DAY_S)
    grid = posterior.grid(**BOX, resolution=0.04)
    chosen = np.random.default_rng(1).integers((grid.width, grid.height), size=(300, 2))
    centres = (chosen.astype(np.float64) + 0.5) * 0.04
    mean, sd = posterior.points(centres)
    x, y = chosen.T
    assert (np.abs(grid.mean[y, x] - mean) <= 0.05 * sd).all()
    assert grid.sd[y, x] == pytest.approx(sd, rel=0.15)
    assert not (np.abs(grid.mean[y, x] - mean) < 1e-7).all(), "this was not by lattice"


@given(some_readings(), st.lists(hypers, min_size=1, max_size=3), st.floats(0.0, 12.0))
def test_a_reading_is_foretold_as_the_textbook_has_it_at_any_later_time(
    readings: Readings, drawn: list[Hyper], later_h: float
) -> None:
    model = Model(Scale(20.0, 2.0), 2.0, DAY_S, drawn[0], tuple(drawn))
    newest_h = float(readings.time_s.max()) / 3600.0
    hours = newest_h + np.array([0.0, later_h / 2.0, later_h])
    posterior = model.posterior(readings, (newest_h + 6.0) * 3600.0)
    mean, sd = posterior.foretell(PLACES, np.maximum(hours * 3600.0, readings.time_s.max()))
    y = (readings.value - 20.0) / 2.0
    for index, (place, hour) in enumerate(zip(PLACES, hours, strict=True)):
        spot = spot_at(place, float(hour))
        each = [textbook_gp.foretold(spots_of(readings), y, spot, h) for h in drawn]
        middle = sum(one for one, _ in each) / len(each)
        variance = sum(
            (one - middle) ** 2 + var + h.tau**2 + 0.02**2
            for (one, var), h in zip(each, drawn, strict=True)
        ) / len(each)
        assert mean[index] == pytest.approx(20.0 + 2.0 * middle, abs=1e-6 * (1 + abs(middle)))
        assert sd[index] ** 2 == pytest.approx(4.0 * variance, rel=1e-6)


@pytest.mark.parametrize("wrong", [-1.0, np.nan, np.inf])
def test_nothing_is_foretold_of_the_past(wrong: float) -> None:
    day = a_day(tags=3, passes=2)
    posterior = fit(day).posterior(day, DAY_S)
    newest_s = day.time_s.max()
    assert np.isfinite(posterior.foretell(PLACES[:1], np.array([newest_s]))).all()
    with pytest.raises(ValueError, match="time_s must be finite and not before the newest reading"):
        posterior.foretell(PLACES[:1], np.array([newest_s + wrong]))


def test_the_error_grows_with_the_distance_and_with_the_age() -> None:
    day = a_day(tags=6, passes=20)
    model = fit(day, ideal=(18.0, 26.0))
    near, far = np.array([day.xy[0]]), np.array([[60.0, 60.0]])
    at_once, later = model.posterior(day, DAY_S), model.posterior(day, DAY_S + 6 * 3600.0)
    assert at_once.points(near)[1][0] < at_once.points(far)[1][0]
    assert at_once.points(near)[1][0] < later.points(near)[1][0]


def test_a_tag_that_reads_three_degrees_more_has_changed_and_the_others_have_not() -> None:
    day = a_day(passes=24)
    model = fit(day, ideal=(18.0, 26.0))
    assert not any(change.has_changed for change in model.posterior(day, DAY_S).changes() if change)
    value = day.value.copy()
    own = np.flatnonzero(day.tag == 3)
    value[own[np.argsort(day.time_s[own])[-4:]]] += 3.0
    changed = Readings(day.time_s, day.tag, value, day.xy)
    changes = model.posterior(changed, DAY_S).changes()
    found = changes[3]
    assert found is not None
    assert found.has_changed
    assert found.offset == pytest.approx(3.0, abs=0.5)
    assert max(abs(one.z) for tag, one in enumerate(changes) if one and tag != 3) < abs(found.z)


def test_a_tag_without_readings_has_nothing_to_change() -> None:
    day = a_day(tags=3, passes=2)
    more = Readings(day.time_s, day.tag, day.value, np.vstack((day.xy, [(1.0, 1.0)])))
    changes = fit(more, ideal=(18.0, 26.0)).posterior(more, DAY_S).changes()
    assert changes[3] is None
    assert all(changes[:3])
