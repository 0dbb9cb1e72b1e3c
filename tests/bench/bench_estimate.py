"""How sure the estimate may be: against the simulator's truth, beside IDW and kriging.

On houses and seeds that nothing was chosen on, and that were looked at once: priors were chosen on
seeds 100 to 111, earlier versions held against 1,000 on. As in the node, fits are not told the
ideal range. Of each field: the error (RMSE) as a ratio to that
of IDW over the cells that IDW paints, and the share of all cells of the house whose truth lies in
the 90 % interval. `worse` is the share of fields with a larger error than IDW's, `narrow` that of
fields with a coverage under 0.7.
"""

from __future__ import annotations

import argparse
import sys
from collections import defaultdict
from collections.abc import Iterator

import numpy as np

from lupin_bridge.judge.choosing import own_sensors
from lupin_twin.estimate import Readings, fit
from lupin_twin.fields import FieldRules
from lupin_twin.idw import compute_idw_field
from lupin_twin.parameters import TwinParameters
from tests.bench.worlds import HEIGHT_M, HOUR_S, PASS_S, WIDTH_M, Floats, World, others, own

CELL_M = 0.25
INTERVAL_SDS = 1.645
RULES = FieldRules.of(TwinParameters())
# How long the patrol has driven, and how long it has stood since, s.
PHASES = {
    "10 scans": (9 * PASS_S / 30, 0.0),
    "one pass": (PASS_S, 0.0),
    "steady": (20 * HOUR_S, 0.0),
    "dead 6 h, first day": (15 * HOUR_S, 6 * HOUR_S),
    "dead 6 h, second day": (40 * HOUR_S, 6 * HOUR_S),
}


def cells() -> Floats:
    xs = (np.arange(int(WIDTH_M / CELL_M)) + 0.5) * CELL_M
    ys = (np.arange(int(HEIGHT_M / CELL_M)) + 0.5) * CELL_M
    return np.array([(x, y) for y in ys for x in xs])


def latest(readings: Readings) -> Readings:
    """The newest of each tag."""
    newest = {int(tag): index for index, tag in enumerate(readings.tag)}
    return readings.take(np.array(sorted(newest.values())))


def judged(
    world: World, of_house: int, phase: str, *, knows_ideal: bool
) -> Iterator[tuple[str, float, float]]:
    """(method, RMSE over IDW's cells, coverage over all)."""
    drives_s, stands_s = PHASES[phase]
    at_s = drives_s + stands_s
    heard = world.scans(of_house, drives_s).recent(at_s)
    if len(heard) < 2:
        return
    places = cells()
    truth = world.truth(places, at_s)
    now = latest(heard)
    field = compute_idw_field(
        list(zip(*world.xy[now.tag].T, now.value, strict=True)),
        bbox_min_x=0.0,
        bbox_min_y=0.0,
        bbox_max_x=WIDTH_M,
        bbox_max_y=HEIGHT_M,
        resolution=CELL_M,
        falloff_radius_m=RULES.falloff_radius_m,
        max_distance_m=RULES.max_distance_m,
        power=RULES.idw_power,
    ).values
    painted = np.isfinite(field)
    yield "idw", rmse(field[painted] - truth[painted]), float("nan")
    ideal = own_sensors().named(world.sensor).ranges(is_day=True, species="").ideal
    range_ = None if ideal is None or not knows_ideal else (ideal.low, ideal.high)
    all_now = Readings(np.full(len(now), at_s), now.tag, now.value, now.xy)
    for method, readings in (("estimate", heard), ("kriging", all_now)):
        mean, sd = fit(readings, ideal=range_).posterior(readings, at_s).points(places)
        inside = np.abs(mean - truth) <= INTERVAL_SDS * sd
        yield method, rmse(mean[painted] - truth[painted]), float(inside.mean())


def rmse(off: Floats) -> float:
    return float(np.sqrt(np.mean(off**2)))


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=2000, help="the first seed")
    parser.add_argument("--count", type=int, default=8, help="houses of each of the three sorts")
    parser.add_argument(
        "--with-ideal", action="store_true", help="fits that are told the ideal ranges"
    )
    options = parser.parse_args([] if arguments is None else arguments)
    seeds = range(options.first, options.first + options.count)
    results: dict[tuple[str, str], list[tuple[float, float, float]]] = defaultdict(list)
    groups = {
        "own": own(seeds),
        "houses": others(seeds),
        "weather": others(seeds, has_weather=True),
    }
    for group, worlds in groups.items():
        for world, of_house in worlds:
            for phase in PHASES:
                answers = judged(world, of_house, phase, knows_ideal=options.with_ideal)
                found = {method: rest for method, *rest in answers}
                if "idw" not in found or not found["idw"][0]:
                    continue
                for method in ("estimate", "kriging"):
                    error, inside = found[method]
                    for row in {"all", phase.partition(",")[0], phase, f"{phase}, {group}"}:
                        results[row, method].append((error, found["idw"][0], inside))
            print(".", end="", file=sys.stderr, flush=True)
    print(f"\n{'':<34}{'fields':>7}{'to IDW':>8}{'covers':>8}{'worse':>7}{'narrow':>8}   kriging")
    for phase, method in sorted(results):
        if method != "estimate":
            continue
        rows = np.array(results[phase, method])
        rival = np.array(results[phase, "kriging"])
        ratios = rows[:, 0] / rows[:, 1]
        print(
            f"{phase:<34}{len(rows):>7}{ratio(rows):>8.2f}{rows[:, 2].mean():>8.3f}"
            f"{(ratios > 1).mean():>7.0%}{(rows[:, 2] < 0.7).mean():>8.0%}"
            f"   {ratio(rival):.2f} {rival[:, 2].mean():.2f}"
        )


def ratio(rows: Floats) -> float:
    """The geometric mean of the errors' ratios: each field counts the same."""
    kept = rows[(rows[:, 0] > 0) & (rows[:, 1] > 0)]
    return float(np.exp(np.mean(np.log(kept[:, 0] / kept[:, 1]))))


if __name__ == "__main__":
    main(sys.argv[1:])
