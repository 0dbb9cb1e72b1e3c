"""How fast fields are computed, each beside the plain loop of the same run.

The loop is `tests/oracle_idw.py`, the written definition. Where it would take minutes it runs
over a sample of the cells, and the table says so. Times are the best of several runs.
"""

import sys
import time
from collections.abc import Callable, Sequence

import numpy as np

from lupin_twin.field.grid import FieldGrid, cell_centres
from lupin_twin.field.idw import FieldSample, compute_idw_field
from tests.oracle_idw import value_at

REACH_M = 1.5
LOOP_PAIRS = 2_000_000


def best_of(run: Callable[[], object], seconds: float = 1.0) -> float:
    """The shortest of as many runs as fit into `seconds`, three at least."""
    run()
    times: list[float] = []
    end = time.perf_counter() + seconds
    while len(times) < 3 or time.perf_counter() < end:
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return min(times)


def scattered(count: int, side: float) -> list[FieldSample]:
    rng = np.random.default_rng(count)
    return [
        FieldSample(x, y, 15.0 + 15.0 * value)
        for x, y, value in (rng.random((count, 3)) * (side, side, 1.0)).tolist()
    ]


def field(samples: Sequence[FieldSample], side: float, cells: int) -> FieldGrid:
    return compute_idw_field(
        samples,
        bbox_min_x=0.0,
        bbox_min_y=0.0,
        bbox_max_x=side,
        bbox_max_y=side,
        resolution=side / cells,
        falloff_radius_m=REACH_M,
        max_distance_m=REACH_M,
        power=2.0,
    )


def loop_seconds(samples: Sequence[FieldSample], side: float, cells: int) -> tuple[float, bool]:
    """(seconds of the plain loop, whether they are extrapolated from some of the cells)."""
    centres = cell_centres(0.0, cells, side / cells).tolist()
    points = [(x, y) for y in centres for x in centres]
    step = max(1, len(points) * len(samples) // LOOP_PAIRS)
    some = points[::step]

    def loop() -> None:
        for point in some:
            value_at(point, samples, falloff_radius_m=REACH_M, max_distance_m=REACH_M, power=2.0)

    return best_of(loop, seconds=0.0) * len(points) / len(some), step > 1


def main() -> None:
    print(f"Python {sys.version.split()[0]}, numpy {np.__version__}")
    print("fields (falloff and gate 1.5 m, power 2); ~ extrapolated from some of the cells")
    for count, side, cells in (
        (30, 5.0, 200),
        (30, 20.0, 200),
        (1_000, 50.0, 1_000),
        (1_000, 20.0, 1_000),
        (10_000, 100.0, 2_000),
    ):
        samples = scattered(count, side)
        seconds = best_of(lambda: field(samples, side, cells))  # noqa: B023  # run at once
        loop_s, is_extrapolated = loop_seconds(samples, side, cells)
        print(
            f"{cells} x {cells} cells, {count} tags, {side:g} m: {seconds * 1e3:.3f} ms;"
            f" loop {'~' * is_extrapolated}{loop_s / seconds:.0f} x",
            flush=True,
        )
