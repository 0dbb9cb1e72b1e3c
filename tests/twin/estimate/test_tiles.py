"""Kriging by what is near: close to that of all, without seams, the same on a grid as anywhere."""

from __future__ import annotations

import numpy as np
import pytest

from lupin_twin.estimate.kernel import PRIOR_MEDIAN, UNKNOWN_MEAN, nearness
from lupin_twin.estimate.nowcast import Nowcasts
from lupin_twin.estimate.tiles import NEAREST, Net, Tiles
from lupin_twin.grid import FloatArray
from lupin_twin.idw import Abandoned

H = PRIOR_MEDIAN


def heard(tags: int, metres: float, seed: int = 0) -> Nowcasts:
    chance = np.random.default_rng(seed)
    xy = chance.uniform(0.0, metres, (tags, 2))
    return Nowcasts(xy, np.sin(xy[:, 0]) + 3.0, chance.uniform(0.02, 0.3, tags), 0.25)


def exactly(now: Nowcasts, places: FloatArray) -> tuple[FloatArray, FloatArray]:
    """By all tags at once, as the textbook has it: the level is one more normal number."""

    def common(one: FloatArray, other: FloatArray) -> FloatArray:
        near = nearness(one[:, 0], other[:, 0], H.l) * nearness(one[:, 1], other[:, 1], H.l)
        result: FloatArray = UNKNOWN_MEAN + H.local_variance * near
        return result

    covariance = common(now.xy, now.xy) + np.diag(now.noise)
    shared = common(places, now.xy)
    solved = np.linalg.solve(covariance, shared.T)
    known = np.einsum("ij,ji->i", shared, solved)
    return now.value @ solved, UNKNOWN_MEAN + H.local_variance - known + now.drift


def test_few_tags_are_all_near_and_it_is_exact() -> None:
    now = heard(NEAREST, 10.0)
    places = np.random.default_rng(1).uniform(-5.0, 15.0, (200, 2))
    mean, variance = Tiles(H, now).at(places)
    expected, expected_variance = exactly(now, places)
    assert mean == pytest.approx(expected, abs=1e-4)
    assert variance == pytest.approx(expected_variance, rel=1e-3)


@pytest.mark.parametrize("metres", [10.0, 40.0])
def test_many_are_off_by_little(metres: float) -> None:
    now = heard(300, metres)
    places = np.random.default_rng(1).uniform(0.0, metres, (2_000, 2))
    mean, variance = Tiles(H, now).at(places)
    expected, expected_variance = exactly(now, places)
    sd = np.sqrt(expected_variance)
    off = np.abs(mean - expected) / sd
    assert np.sqrt(np.mean(off**2)) < 0.12
    assert off.max() < 0.5
    assert np.sqrt(variance) == pytest.approx(sd, rel=0.25)
    assert np.sqrt(variance).mean() == pytest.approx(sd.mean(), rel=0.03)


def test_nothing_jumps_from_one_knot_to_the_next() -> None:
    now = heard(300, 20.0)
    tiles, step = Tiles(H, now), Net(now.xy).step_m
    seams = Net(now.xy).origin[0] + step * np.arange(0.5, 4.0, 0.5)  # at knots, and half-way
    for seam in seams:
        y = np.linspace(0.0, 20.0, 50)
        beside = [np.column_stack((np.full(50, seam + by), y)) for by in (-1e-6, 1e-6)]
        (mean, variance), (mean_next, variance_next) = (tiles.at(places) for places in beside)
        assert mean == pytest.approx(mean_next, abs=1e-4)
        assert variance == pytest.approx(variance_next, abs=1e-4)


def test_a_grid_is_its_places() -> None:
    now = heard(200, 12.0)
    x, y = np.linspace(-2.0, 15.0, 37), np.linspace(1.0, 13.0, 23)
    mean, variance = Tiles(H, now).on(x, y)
    places = np.column_stack((np.tile(x, len(y)), np.repeat(y, len(x))))
    there = Tiles(H, now).at(places)
    assert mean.ravel() == pytest.approx(there[0], abs=1e-4)
    assert variance.ravel() == pytest.approx(there[1], rel=1e-3)


@pytest.mark.parametrize("shape", [(1.0, 0.0), (0.0, 0.0), (1.0, 1e-3), (1.0, 1.0)])
@pytest.mark.parametrize("tags", [1, 2, 500])
def test_there_are_as_many_knots_as_tags_can_feed_whatever_the_house_s_shape(
    shape: tuple[float, float], tags: int
) -> None:
    chance = np.random.default_rng(tags)
    xy = chance.uniform(0.0, 100.0, (tags, 2)) * shape
    net = Net(xy)
    assert (net.shape >= 1).all()
    assert net.shape.prod() <= max(4, tags / 8) * 2 + 10
    now = Nowcasts(xy, np.ones(tags), np.full(tags, 0.1), 0.0)
    mean, variance = Tiles(H, now).at(np.array([(0.0, 0.0), (500.0, -500.0)]))
    assert mean == pytest.approx(1.0, abs=0.05)
    assert (variance > 0.0).all()


def test_two_crowds_far_apart_are_each_by_some_of_their_own() -> None:
    one, other = heard(100, 5.0), heard(100, 5.0, seed=1)
    xy = np.vstack((one.xy, other.xy + 1_000.0))
    now = Nowcasts(xy, np.r_[one.value, other.value], np.r_[one.noise, other.noise], 0.0)
    places = np.array([(2.0, 2.0), (1_003.0, 1_002.0)])
    mean, variance = Tiles(H, now).at(places)
    expected, expected_variance = exactly(now, places)
    # Each crowd hangs on few knots: not all of it counts, and the sd says so.
    assert (variance > 0.9 * expected_variance).all()
    assert (np.abs(mean - expected) < np.sqrt(variance)).all()


def test_who_is_not_waited_for_ends() -> None:
    tiles = Tiles(H, heard(200, 12.0))
    with pytest.raises(Abandoned):
        tiles.on(np.linspace(0.0, 12.0, 10), np.linspace(0.0, 12.0, 10), lambda: True)
    with pytest.raises(Abandoned):
        tiles.at(np.array([(1.0, 1.0)]), lambda: True)
