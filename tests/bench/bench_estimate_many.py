"""The estimate of many tags, by tiles: against the truth beside IDW, and against all at once.

Houses that nothing was chosen on: places differ by waves of 3 to 20 m, in how warm they are and in
how their day goes, under clouds that pass. Of each field as in `bench_estimate`, by the readings
that the node would choose: of a day, and of the first six hours. What all readings say at once is
reckoned for 1,000 tags with four readings each; beyond, nobody can.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np  # its threads are counted when it is loaded

from lupin_twin.estimate import Readings
from lupin_twin.estimate.kernel import HOURS, UNKNOWN_MEAN, daily, matern, nearness, pairs_of
from lupin_twin.estimate.model import Model
from lupin_twin.estimate.triangle import root_of_inverse
from lupin_twin.estimates import PER_MANY_TAGS, fitted
from lupin_twin.fields import FieldRules
from lupin_twin.idw import compute_idw_field
from lupin_twin.parameters import TwinParameters
from tests.bench.bench_estimate import INTERVAL_SDS, rmse
from tests.bench.worlds import HOUR_S, PASS_S, Floats
from tests.support.estimates import DAY_S

# Tags, m of the house's side.
HOUSES = ((1_000, 20.0), (1_000, 50.0), (10_000, 100.0))
SEEDS = range(1_000, 1_004)
CELLS = 200
# How many passes were heard, and how long it has been silent since, s.
PHASES = {
    "steady": (32, 0.0),
    "silent for 6 h": (32, 6 * HOUR_S),
    "steady, first 6 h": (8, 0.0),
    "silent for 6 h, first 6 h": (8, 6 * HOUR_S),
}
NOISE = 0.2
_WAVES = 16
_CLOUD_HOURS = 3.0
RULES = FieldRules.of(TwinParameters())

Truth = Callable[[Floats, Floats], Floats]


def waves(chance: np.random.Generator) -> Callable[[Floats], Floats]:
    """Something of variance 1 over places (k, 2)."""
    length, angle = chance.uniform(3.0, 20.0, _WAVES), chance.uniform(0.0, 2 * np.pi, _WAVES)
    numbers = 2 * np.pi / length * np.array([np.cos(angle), np.sin(angle)])
    phase = chance.uniform(0.0, 2 * np.pi, _WAVES)
    return lambda xy: np.cos(xy @ numbers + phase).sum(axis=1) * (2.0 / _WAVES) ** 0.5


def truth_of(chance: np.random.Generator) -> Truth:
    """At places (k, 2) and times (k,), °C."""
    warm, swing, phase = waves(chance), waves(chance), chance.uniform(0.0, 2 * np.pi)
    at_s = np.arange(-DAY_S, DAY_S, 1_800.0)
    keeps = float(np.exp(-0.5 / _CLOUD_HOURS))
    clouds = np.zeros(len(at_s))
    for step, fresh in enumerate(chance.standard_normal(len(at_s) - 1), 1):
        clouds[step] = keeps * clouds[step - 1] + (1.0 - keeps**2) ** 0.5 * fresh

    def truth(xy: Floats, time_s: Floats) -> Floats:
        day = np.sin(2 * np.pi * time_s / DAY_S + phase)
        course = (4.0 + 0.5 * swing(xy)) * day + 0.4 * np.interp(time_s, at_s, clouds)
        return np.asarray(21.0 + course + warm(xy))

    return truth


def house(tags: int, metres: float, seed: int, passes: int) -> tuple[Truth, Readings]:
    """What was read of each tag in so many passes until 0 s."""
    chance = np.random.default_rng([seed, tags, int(metres)])
    truth, xy = truth_of(chance), chance.uniform(0.0, metres, (tags, 2))
    time_s = np.sort(chance.uniform(-passes * PASS_S, 0.0, passes * tags))
    tag = np.concatenate([chance.permutation(tags) for _ in range(passes)])
    value = truth(xy[tag], time_s) + chance.normal(0.0, NOISE, len(tag))
    return truth, Readings(time_s, tag, value, xy)


def judged(tags: int, metres: float, seed: int, phase: str) -> list[float]:
    """The error as a ratio to IDW's where that paints; the coverage over all cells."""
    passes, silent_s = PHASES[phase]
    truth, heard = house(tags, metres, seed, passes)
    readings = heard.recent(silent_s).thinned(PER_MANY_TAGS)
    cell_m = metres / CELLS
    newest = {int(tag): index for index, tag in enumerate(readings.tag)}
    latest = readings.take(np.array(sorted(newest.values())))
    field = compute_idw_field(
        list(zip(*latest.xy[latest.tag].T, latest.value, strict=True)),
        bbox_min_x=0.0,
        bbox_min_y=0.0,
        bbox_max_x=metres,
        bbox_max_y=metres,
        resolution=cell_m,
        falloff_radius_m=RULES.falloff_radius_m,
        max_distance_m=RULES.max_distance_m,
        power=RULES.idw_power,
    ).values.ravel()
    model = fitted(readings, DAY_S)
    grid = model.posterior(readings, silent_s).grid(
        bbox_min_x=0.0,
        bbox_min_y=0.0,
        bbox_max_x=metres,
        bbox_max_y=metres,
        resolution=cell_m,
    )
    centres = (np.arange(CELLS) + 0.5) * cell_m
    places = np.column_stack((np.tile(centres, CELLS), np.repeat(centres, CELLS)))
    off = grid.mean.ravel() - truth(places, np.full(len(places), silent_s))
    painted = np.isfinite(field)
    of_idw = field[painted] - truth(places[painted], np.full(int(painted.sum()), silent_s))
    inside = np.abs(off) <= INTERVAL_SDS * grid.sd.ravel()
    return [rmse(off[painted]) / rmse(of_idw), float(inside.mean())]


def exactly(model: Model, readings: Readings, at_s: float, places: Floats) -> tuple[Floats, Floats]:
    """Mean and sd (k,) by all readings at once: Rasmussen and Williams, 2006, 2.2."""
    h = model.most_probable
    root = root_of_inverse(pairs_of(readings, DAY_S).covariance(h))
    ages_h = (at_s - readings.time_s) * (HOURS / DAY_S)
    house_part = UNKNOWN_MEAN + h.sg**2 * matern(ages_h, h.lg) + h.sp**2 * daily(ages_h)
    place_part = h.sa**2 + h.sh**2 * matern(ages_h, h.lh) + h.sq**2 * daily(ages_h)
    (x, y), (tag_x, tag_y) = places.T, readings.xy[readings.tag].T
    near = nearness(x, tag_x, h.l) * nearness(y, tag_y, h.l)
    rooted = root @ (house_part + place_part * near).T
    mean = rooted.T @ (root @ model.scale.standardised(readings.value))
    variance = h.prior_variance - np.square(rooted).sum(axis=0)
    return mean * model.scale.spread + model.scale.centre, np.sqrt(variance) * model.scale.spread


def beside_all(metres: float, silent_s: float) -> Sequence[float]:
    """How far the mean is off that of all at once, sds: rms and most; the sd as a share of it."""
    _, readings = house(1_000, metres, SEEDS[0], passes=32)
    readings = readings.recent(silent_s).thinned(4)
    model = fitted(readings, DAY_S)
    places = np.random.default_rng(1).uniform(0.0, metres, (1_000, 2))
    mean, sd = model.posterior(readings, silent_s).points(places)
    exact_mean, exact_sd = exactly(model, readings, silent_s, places)
    off, share = np.abs(mean - exact_mean) / exact_sd, sd / exact_sd
    return rmse(off), float(off.max()), float(share.mean()), float(share.min()), float(share.max())


def main() -> None:
    print(f"{f'{len(SEEDS)} houses each':<50}{'to IDW':>8}{'covers':>8}")
    for tags, metres in HOUSES:
        for phase in PHASES:
            rows = np.array([judged(tags, metres, seed, phase) for seed in SEEDS])
            ratio, covers = np.exp(np.log(rows[:, 0]).mean()), rows[:, 1].mean()
            label = f"{tags} tags in {metres:g} m, {phase}"
            print(f"{label:<50}{ratio:>8.2f}{covers:>8.2f}", flush=True)
    print(
        "against all readings at once, 1,000 tags x 4: mean off (sds; rms, most), sd (mean, range)"
    )
    for metres in (20.0, 50.0):
        for phase, silent_s in (("steady", 0.0), ("silent for 6 h", 6 * HOUR_S)):
            rms, most, share, low, high = beside_all(metres, silent_s)
            print(
                f"{f'in {metres:g} m, {phase}':<50}{rms:>8.2f}{most:>8.2f}{share:>8.2f}"
                f"   {low:.2f} to {high:.2f}"
            )


if __name__ == "__main__":
    main()
