"""The estimate of many tags, by the nearest ones: against the truth, beside IDW.

Greenhouses that nothing was tuned on: positions differ by waves of 3 to 20 m, in their warmth
and in the course of their day, under passing clouds. Of each field as in `bench_estimate`, by the
readings that the node would choose: of a day, and of the first six hours.
"""

from collections.abc import Callable

import numpy as np

from lupin_twin.estimate.engine import thinned
from lupin_twin.estimate.kernel import Readings
from lupin_twin.estimate.model import fit
from tests.bench.bench_estimate import INTERVAL_SDS, idw_of, rmse
from tests.bench.other_worlds import DAY_S, HOUR_S, Floats

# Tags, m of the greenhouse's side.
HOUSES = ((200, 20.0), (1_000, 20.0), (1_000, 50.0), (10_000, 100.0))
CELLS = 200
PASS_S = 45 * 60.0
# How many rounds were received, and how long it has been silent since, s.
PHASES = {
    "steady": (32, 0.0),
    "silent for 6 h": (32, 6 * HOUR_S),
    "steady, first 6 h": (8, 0.0),
    "silent for 6 h, first 6 h": (8, 6 * HOUR_S),
}
# Greenhouses of each. Where the day is hardly known, all cells of one are right, or none are.
GREENHOUSES = 3
OF_SHORT_DAYS = 24
NOISE = 0.2
_WAVES = 16
_CLOUD_HOURS = 3.0

Truth = Callable[[Floats, Floats], Floats]


def waves(chance: np.random.Generator) -> Callable[[Floats], Floats]:
    """A quantity of variance 1 over positions (k, 2)."""
    length, angle = chance.uniform(3.0, 20.0, _WAVES), chance.uniform(0.0, 2 * np.pi, _WAVES)
    numbers = 2 * np.pi / length * np.array([np.cos(angle), np.sin(angle)])
    phase = chance.uniform(0.0, 2 * np.pi, _WAVES)
    return lambda xy: np.cos(xy @ numbers + phase).sum(axis=1) * (2.0 / _WAVES) ** 0.5


def truth_of(chance: np.random.Generator) -> Truth:
    """At positions (k, 2) and times (k,), °C."""
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


def greenhouse(tags: int, metres: float, seed: int, passes: int) -> tuple[Truth, Readings]:
    """The readings of each tag in that many rounds until 0 s."""
    chance = np.random.default_rng([seed, tags, int(metres)])
    truth, xy = truth_of(chance), chance.uniform(0.0, metres, (tags, 2))
    time_s = np.sort(chance.uniform(-passes * PASS_S, 0.0, passes * tags))
    tag = np.concatenate([chance.permutation(tags) for _ in range(passes)])
    value = truth(xy[tag], time_s) + chance.normal(0.0, NOISE, len(tag))
    return truth, Readings(time_s, tag, value, xy)


def judged(tags: int, metres: float, seed: int, phase: str) -> list[float]:
    """The error as a ratio to IDW's where that paints; the coverage over all cells."""
    passes, silent_s = PHASES[phase]
    truth, received = greenhouse(tags, metres, seed, passes)
    readings = thinned(received, silent_s, DAY_S)
    cell_m = metres / CELLS
    field = idw_of(received, metres, metres, cell_m).ravel()
    grid = (
        fit(readings)
        .posterior(readings, silent_s)
        .grid(
            bbox_min_x=0.0,
            bbox_min_y=0.0,
            bbox_max_x=metres,
            bbox_max_y=metres,
            resolution=cell_m,
        )
    )
    centres = (np.arange(CELLS) + 0.5) * cell_m
    places = np.stack(np.meshgrid(centres, centres), axis=-1).reshape(-1, 2)
    true = truth(places, np.full(len(places), silent_s))
    off = grid.mean.ravel() - true
    painted = np.isfinite(field)
    inside = np.abs(off) <= INTERVAL_SDS * grid.sd.ravel()
    return [rmse(off[painted]) / rmse((field - true)[painted]), float(inside.mean())]


def greenhouses(tags: int, phase: str) -> int:
    """How many are judged."""
    passes, silent_s = PHASES[phase]
    is_short = passes * PASS_S < DAY_S / 2.0 and silent_s > 0.0
    return OF_SHORT_DAYS if is_short and tags <= 1_000 else GREENHOUSES


def main() -> None:
    print(f"{'':<44}{'houses':>6}{'to IDW':>8}{'covers':>8}{'least':>8}")
    for tags, metres in HOUSES:
        for phase in PHASES:
            count = greenhouses(tags, phase)
            seeds = range(2_000, 2_000 + count)
            rows = np.array([judged(tags, metres, seed, phase) for seed in seeds])
            ratio, covers = np.exp(np.log(rows[:, 0]).mean()), rows[:, 1]
            label = f"{tags} tags in {metres:g} m, {phase}"
            print(
                f"{label:<44}{count:>6}{ratio:>8.2f}{covers.mean():>8.2f}{covers.min():>8.2f}",
                flush=True,
            )
