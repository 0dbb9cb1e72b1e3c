"""What an estimate costs beside IDW on the same grid: ms of one core, the best of several."""

import time
from collections.abc import Callable
from functools import partial
from typing import TypeVar

from lupin_twin.estimate.engine import thinned
from lupin_twin.estimate.model import fit
from lupin_twin.estimate.posterior import Posterior
from lupin_twin.field.idw import FieldSample, compute_idw_field
from tests.support.estimates import DAY_S, many_tags

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
    """IDW; a fit; a posterior, until its first value; a grid; all tags checked."""
    readings = many_tags(tags, each, metres)
    at_s = float(readings.time_s.max())
    readings = thinned(readings, at_s, DAY_S)
    resolution = metres / side
    box = {"bbox_min_x": 0.0, "bbox_min_y": 0.0, "bbox_max_x": metres, "bbox_max_y": metres}
    latest = [FieldSample(x, y, 20.0) for x, y in readings.xy.tolist()]
    idw = partial(
        compute_idw_field,
        latest,
        bbox_min_x=0.0,
        bbox_min_y=0.0,
        bbox_max_x=metres,
        bbox_max_y=metres,
        resolution=resolution,
        falloff_radius_m=1.5,
        max_distance_m=1.5,
        power=2.0,
    )
    idw_ms, _ = best(idw, 3)
    fit_ms, model = best(partial(fit, readings), 2)

    def load() -> Posterior:
        posterior = model.posterior(readings, at_s)
        posterior.points(readings.xy[:1])  # with many tags, the work starts with the first query
        return posterior

    load_ms, posterior = best(load, 3)
    times = 7 if tags < 1_000 else 1
    grid_ms, _ = best(partial(posterior.grid, **box, resolution=resolution), times)
    checks_ms, _ = best(posterior.changes, 1)
    return [idw_ms, fit_ms, load_ms, grid_ms, checks_ms]


def main() -> None:
    columns = ("IDW", "fit", "load", "grid", "checks")
    print(f"{'tags x readings, cells':<34}" + "".join(f"{name:>10}" for name in columns))
    for tags, each, metres, side in GREENHOUSES:
        label = f"{tags} x {each}, {side} x {side} in {metres:g} m"
        print(f"{label:<34}" + "".join(f"{one:>10.1f}" for one in costs(tags, each, metres, side)))
