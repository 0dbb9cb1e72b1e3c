"""How certain the estimate may be, by sorts of greenhouses that share nothing with the simulator.

Of each field: the error (RMSE) as a ratio to that of IDW over the cells that IDW paints; the share
of all cells of the floor whose truth lies in the 90 % interval; the CRPS as a ratio to IDW's error.
`narrow` is the share of fields with a coverage under 0.7, `worse` that of fields with a larger
error than IDW's.
"""

from collections import defaultdict
from collections.abc import Iterator
from math import erf, exp, pi, sqrt
from typing import NamedTuple

import numpy as np

from lupin_twin.core.parameters import TwinParameters
from lupin_twin.estimate.engine import TagPast, readings_of
from lupin_twin.estimate.kernel import Readings
from lupin_twin.estimate.model import Model, fit
from lupin_twin.field.engine import FieldRules
from lupin_twin.field.idw import compute_idw_field
from tests.bench.other_worlds import HOUR_S, JUDGING, SORTS, Floats, World, world_of

CELL_M = 0.25
INTERVAL_SDS = 1.645
RULES = FieldRules.of(TwinParameters())
# How long the robot has driven, in rounds or hours, and how long it has stood since, h.
PHASES = {"after one round": (None, 0.0), "steady": (20.0, 0.0), "silent for 6 h": (30.0, 6.0)}


class Field(NamedTuple):
    """The result of one estimate; error and CRPS as ratios to IDW's error."""

    error: float
    covers: float
    crps: float


class Case(NamedTuple):
    """A greenhouse at a moment: the readings that count, the cells' positions, the truth there."""

    world: World
    readings: Readings
    at_s: float
    places: Floats
    truth: Floats
    idw: Floats


def cases() -> Iterator[tuple[str, str, Case]]:
    """(sort, phase, case)."""
    for sort in SORTS:
        for seed in JUDGING:
            world = world_of(sort, seed)
            for phase in PHASES:
                yield sort, phase, case_of(world, phase, seed)


def case_of(world: World, phase: str, seed: int) -> Case:
    hours, silent_h = PHASES[phase]
    drives_s = world.round_s if hours is None else hours * HOUR_S
    at_s = drives_s + silent_h * HOUR_S
    all_read = world.read(drives_s, seed)
    width, height = (int(side / CELL_M) for side in world.size_m)
    x, y = (np.arange(width) + 0.5) * CELL_M, (np.arange(height) + 0.5) * CELL_M
    places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    idw = idw_of(all_read, width * CELL_M, height * CELL_M, CELL_M)
    truth = world.truth(places, np.full(len(places), at_s))
    return Case(world, as_received(all_read, at_s), 0.0, places, truth, idw)


def idw_of(read: Readings, width_m: float, height_m: float, cell_m: float) -> Floats:
    """The plain field of the latest readings over a floor, cell by cell."""
    latest = {int(tag): row for row, tag in enumerate(read.tag)}
    return compute_idw_field(
        [(*read.xy[tag].tolist(), float(read.value[row])) for tag, row in latest.items()],
        bbox_min_x=0.0,
        bbox_min_y=0.0,
        bbox_max_x=width_m,
        bbox_max_y=height_m,
        resolution=cell_m,
        falloff_radius_m=RULES.falloff_radius_m,
        max_distance_m=RULES.max_distance_m,
        power=RULES.idw_power,
    ).values.astype(np.float64)


def as_received(read: Readings, at_s: float) -> Readings:
    """A twin's input of an estimate, by seconds from `at_s` on."""
    tags = []
    for tag, (x, y) in enumerate(read.xy):
        rows = np.flatnonzero(read.tag == tag)
        own = zip((read.time_s[rows] * 1e9).round(), read.value[rows], strict=True)
        tags.append(TagPast(str(tag), x, y, tuple((int(ns), float(value)) for ns, value in own)))
    return readings_of(tags, round(at_s * 1e9), 24.0 * HOUR_S)


def judged(case: Case, model: Model | None = None) -> Field:
    model = fit(case.readings) if model is None else model
    return compared(case, *model.posterior(case.readings, case.at_s).points(case.places))


def compared(case: Case, mean: Floats, sd: Floats) -> Field:
    """An estimate of the case's positions, compared with IDW's and the truth."""
    painted = np.isfinite(case.idw)
    of_idw = rmse(case.idw[painted] - case.truth[painted])
    off = case.truth - mean
    inside = np.abs(off) <= INTERVAL_SDS * sd
    return Field(
        rmse(off[painted]) / of_idw, float(inside.mean()), float(crps(off, sd).mean()) / of_idw
    )


def crps(off: Floats, sd: Floats) -> Floats:
    """Of normal distributions (Gneiting and Raftery, 2007, eq. 21)."""
    z = off / sd
    below = np.array([0.5 * (1.0 + erf(one / sqrt(2.0))) for one in z])
    density = np.exp(-(z**2) / 2.0) / sqrt(2.0 * pi)
    result: Floats = sd * (z * (2.0 * below - 1.0) + 2.0 * density - 1.0 / sqrt(pi))
    return result


def rmse(off: Floats) -> float:
    return float(np.sqrt(np.mean(off**2)))


def line(name: str, fields: list[Field]) -> str:
    """One row: the geometric mean of the errors' ratios, so that each field counts the same."""
    error, covers, score = np.array(fields).T
    means = exp(np.log(error).mean()), covers.mean(), exp(np.log(score).mean())
    shares = (covers < 0.7).mean(), (error > 1.0).mean()
    return (
        f"{name:<26}{len(fields):>7}"
        + "".join(f"{one:>9.2f}" for one in means)
        + "".join(f"{one:>8.0%}" for one in shares)
    )


def main() -> None:
    rows: dict[str, list[Field]] = defaultdict(list)
    for sort, phase, case in cases():
        field = judged(case)
        for name in (sort, phase, "all"):
            rows[name].append(field)
    print(f"{'':<26}{'fields':>7}{'to IDW':>9}{'covers':>9}{'CRPS':>9}{'narrow':>8}{'worse':>8}")
    for name in (*SORTS, *PHASES, "all"):
        print(line(name, rows[name]))
