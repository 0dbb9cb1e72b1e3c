"""What an estimate costs: ms of one core, the best of several."""

import time
from collections.abc import Callable
from functools import partial
from typing import TypeVar

from lupin_twin.estimate.engine import thinned
from lupin_twin.estimate.model import fit
from lupin_twin.estimate.posterior import Posterior
from tests.bench.bench_estimate_many import greenhouse
from tests.bench.other_worlds import DAY_S

Made = TypeVar("Made")
# Tags, readings of each, m of the greenhouse's side, cells of a side.
GREENHOUSES = (
    (10, 32, 8.0, 200),
    (30, 20, 8.0, 200),
    (1_000, 8, 20.0, 1_000),
    (1_000, 8, 50.0, 1_000),
    (10_000, 8, 100.0, 2_000),
)


def best(make: Callable[[], Made], times: int = 7) -> tuple[float, Made]:
    """Milliseconds of processor time, and the result."""
    spent = []
    for _ in range(times):
        began = time.process_time()
        made = make()
        spent.append((time.process_time() - began) * 1000.0)
    return min(spent), made


def costs(tags: int, each: int, metres: float, side: int) -> list[float]:
    """A fit; a posterior, until its first value; a grid."""
    _, readings = greenhouse(tags, metres, 0, each)
    at_s = float(readings.time_s.max())
    readings = thinned(readings, at_s, DAY_S)
    box = {"bbox_min_x": 0.0, "bbox_min_y": 0.0, "bbox_max_x": metres, "bbox_max_y": metres}
    fit_ms, model = best(partial(fit, readings), 2)

    def load() -> Posterior:
        posterior = model.posterior(readings, at_s)
        posterior.points(readings.xy[:1])  # with many tags, the work starts with the first query
        return posterior

    load_ms, posterior = best(load, 3)
    times = 7 if tags < 1_000 else 1
    grid_ms, _ = best(partial(posterior.grid, **box, resolution=metres / side), times)
    return [fit_ms, load_ms, grid_ms]


def main() -> None:
    columns = ("fit", "load", "grid")
    print(f"{'tags x readings, cells':<34}" + "".join(f"{name:>10}" for name in columns))
    for tags, each, metres, side in GREENHOUSES:
        label = f"{tags} x {each}, {side} x {side} in {metres:g} m"
        print(f"{label:<34}" + "".join(f"{one:>10.1f}" for one in costs(tags, each, metres, side)))
