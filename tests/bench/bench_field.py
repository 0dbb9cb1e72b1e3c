"""How fast fields are made, each beside the plain loop or the naive numpy form of the same run.

    python tests/bench/bench_field.py

The loop is `tests/oracle_idw.py`, the definition written down; the naive form is the definition on
whole arrays, every cell with every sample. Where the loop would take minutes it runs over a sample
of the cells, and the table says so. Times are the best of several runs.
"""

from __future__ import annotations

import gc
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "ros_node" / "lupin_twin")]

from lupin_twin.core.state import Pose, Reading, Scan, TagState, TwinStore  # noqa: E402
from lupin_twin.field.engine import (  # noqa: E402
    FieldCache,
    FieldEngine,
    FieldJob,
    FieldRequest,
    FieldRules,
)
from lupin_twin.field.explored import OccupancyMap, explored_mask  # noqa: E402
from lupin_twin.field.grid import FieldGrid, cell_centres  # noqa: E402
from lupin_twin.field.idw import FieldSample, compute_idw_field  # noqa: E402
from lupin_twin.field.quality import leave_one_out  # noqa: E402
from tests.oracle_idw import value_at  # noqa: E402

REACH_M = 1.5
LOOP_PAIRS = 2_000_000
NAIVE_PAIRS = 50_000_000


def best_of(run: Callable[[], object], seconds: float = 1.0, at_most: int = 200) -> float:
    """The shortest of as many runs as fit into `seconds`, three at least."""
    run()
    times: list[float] = []
    end = time.perf_counter() + seconds
    while len(times) < 3 or (time.perf_counter() < end and len(times) < at_most):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return min(times)


def scattered(count: int, side: float, away: float = 0.0) -> list[FieldSample]:
    rng = np.random.default_rng(count)
    return [
        FieldSample(away + x, away + y, 15.0 + 15.0 * value)
        for x, y, value in (rng.random((count, 3)) * (side, side, 1.0)).tolist()
    ]


def field(
    samples: Sequence[FieldSample],
    side: float,
    cells: int,
    *,
    falloff: float = REACH_M,
    power: float = 2.0,
    explored: npt.NDArray[np.bool_] | None = None,
) -> FieldGrid:
    return compute_idw_field(
        samples,
        bbox_min_x=0.0,
        bbox_min_y=0.0,
        bbox_max_x=side,
        bbox_max_y=side,
        resolution=side / cells,
        falloff_radius_m=falloff,
        max_distance_m=REACH_M,
        power=power,
        explored_mask=explored,
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


def naive(samples: Sequence[FieldSample], side: float, rows: int, cells: int) -> object:
    """The definition on whole arrays, over the first `rows` rows."""
    x, y, value = np.array(samples).T
    cell_x = cell_centres(0.0, cells, side / cells)
    cell_y = cell_centres(0.0, cells, side / cells)[:rows]
    with np.errstate(all="ignore"):
        distance = np.hypot(
            cell_x[None, :, None] - x, cell_y[:, None, None] - y
        )  # rows, columns, samples
        nearest = distance.argmin(axis=2)
        shortest = np.take_along_axis(distance, nearest[..., None], axis=2)[..., 0]
        weight = np.where(distance <= REACH_M, 1.0 / distance**2, 0.0)
        mean = (weight * value).sum(axis=2) / weight.sum(axis=2)
        mean = np.where(shortest < 1e-3, value[nearest], mean)
        return np.where(shortest > REACH_M, np.nan, mean).astype(np.float32)


def naive_seconds(samples: Sequence[FieldSample], side: float, cells: int) -> tuple[float, bool]:
    """(seconds of the naive form, whether they are extrapolated from some of the rows)."""
    rows = min(cells, max(1, NAIVE_PAIRS // (cells * len(samples)) // 4))
    seconds = best_of(lambda: naive(samples, side, rows, cells), seconds=0.5, at_most=5)
    return seconds * cells / rows, rows < cells


def line(name: str, seconds: float, *others: tuple[str, float, bool]) -> None:
    text = f"{name:46} {milliseconds(seconds)}"
    for other, other_seconds, extrapolated in others:
        mark = "~" if extrapolated else " "
        text += f"   {mark}{other} {milliseconds(other_seconds)} {other_seconds / seconds:8.0f} x"
    print(text, flush=True)


def milliseconds(seconds: float) -> str:
    return f"{seconds * 1e3:11.3f} ms"


def compare_fields() -> None:
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
        line(
            f"{cells} x {cells} cells, {count} tags, {side:g} m",
            seconds,
            ("loop", *loop_seconds(samples, side, cells)),
            ("naive numpy", *naive_seconds(samples, side, cells)),
        )


def other_rules() -> None:
    print("\nother rules, 200 x 200 cells, 30 tags, 5 m, and 1000 x 1000 cells, 1000 tags, 50 m")
    small, large = scattered(30, 5.0), scattered(1_000, 50.0)
    half = np.zeros((1_000, 1_000), dtype=np.bool_)
    half[:, :500] = True
    rules: dict[str, dict[str, Any]] = {
        "as above": {},
        "falloff 1 m, less than the gate": {"falloff": 1.0},
        "falloff 3 m, more than the gate": {"falloff": 3.0},
        "power 3": {"power": 3.0},
        "half of it explored": {"explored": half},
    }
    for name, changes in rules.items():
        on_small = dict(changes)
        if "explored" in changes:
            on_small["explored"] = half[:200, 400:600]
        times = (
            best_of(lambda: field(small, 5.0, 200, **on_small)),  # noqa: B023  # run at once
            best_of(lambda: field(large, 50.0, 1_000, **changes)),  # noqa: B023
        )
        print(f"{name:46} {milliseconds(times[0])} {milliseconds(times[1])}", flush=True)


def explored_masks() -> None:
    print("\nexplored mask of 1000 x 1000 cells over a map of 1000 x 1000")
    for name, yaw in (("map along the axes", 0.0), ("map turned", 0.3)):
        occupancy = OccupancyMap(
            frame_id="map",
            stamp_ns=0,
            width=1_000,
            height=1_000,
            resolution=0.05,
            origin_x=0.0,
            origin_y=0.0,
            origin_yaw=yaw,
            cells=np.zeros(1_000_000, dtype=np.int8),
            revision=1,
        )

        def look_up() -> object:
            return explored_mask(
                occupancy,  # noqa: B023  # run at once
                width=1_000,
                height=1_000,
                origin_x=0.0,
                origin_y=0.0,
                resolution=0.05,
            )

        line(name, best_of(look_up))


def compare_far_corner() -> None:
    print("\nten times the tags, nine tenths of them in a far corner outside the box")
    for count, side, cells in ((30, 5.0, 200), (30, 20.0, 200), (1_000, 50.0, 1_000)):
        near = scattered(count, side)
        far = [*near, *scattered(9 * count, side, away=1000.0)]
        seconds = best_of(lambda: field(near, side, cells))  # noqa: B023  # run at once
        with_far = best_of(lambda: field(far, side, cells))  # noqa: B023  # run at once
        print(
            f"{f'{cells} x {cells} cells, {count} and {10 * count} tags':46} "
            f"{milliseconds(seconds)}   {milliseconds(with_far)}   "
            f"{(with_far / seconds - 1) * 100:+.1f} %"
        )


def store_of(samples: Sequence[FieldSample]) -> TwinStore:
    store = TwinStore()
    for index, (x, y, value) in enumerate(samples):
        store.record(
            Scan(
                tag_id=f"tag-{index}",
                stamp_ns=0,
                readings=(Reading("temperature", value),),
                pose=Pose(x, y, 0.5, 0.0, 0.0, 0.0, 1.0),
            )
        )
    return store


def engine() -> FieldEngine:
    rules = FieldRules(
        idw_power=2.0,
        falloff_radius_m=REACH_M,
        max_distance_m=REACH_M,
        max_grid_cells=1_000_000,
    )
    return FieldEngine(rules, FieldCache(max_bytes=64_000_000))


def answer(fields: FieldEngine, request: FieldRequest, store: TwinStore) -> FieldGrid:
    found = fields.lookup(request, store, None)
    if isinstance(found, FieldJob):
        job, found = found, found.compute()
        fields.keep(job, found)
    return found


def compare_hits() -> None:
    print("\nasking again, in process")
    for count, side, cells in ((30, 5.0, 200), (1_000, 50.0, 1_000)):
        samples = scattered(count, side)
        fields, store = engine(), store_of(samples)
        request = FieldRequest("temperature", side / cells, 0.0, 0.0, side, side)
        answer(fields, request, store)
        hit = best_of(lambda: answer(fields, request, store), at_most=5000)  # noqa: B023
        made = best_of(lambda: field(samples, side, cells))  # noqa: B023
        line(f"hit, {cells} x {cells} cells, {count} tags", hit, ("computed", made, False))
    bomb = FieldRequest("temperature", 1e-9, 0.0, 0.0, 1000.0, 1000.0)

    def refused() -> None:
        try:
            answer(fields, bomb, store)
        except ValueError:
            return
        raise AssertionError("the bomb went off")

    line("grid bomb refused", best_of(refused, at_most=5000))


def slide_box() -> None:
    print("\na burst of 1,000 sliding boxes, 200 x 200 cells, 1,000 tags")
    fields, store = engine(), store_of(scattered(1_000, 50.0))
    answer(fields, FieldRequest("temperature", 0.05, 0.0, 0.0, 10.0, 10.0), store)
    gc.collect()
    before = resident_mb()
    start = time.perf_counter()
    for step in range(1_000):
        low = step * 0.04
        answer(fields, FieldRequest("temperature", 0.05, low, low, low + 10.0, low + 10.0), store)
    seconds = time.perf_counter() - start
    gc.collect()
    cache = fields.cache
    print(
        f"{'each':46} {milliseconds(seconds / 1_000)}   resident {before:.1f} MB before, "
        f"{resident_mb():.1f} MB after; kept {len(cache)} fields, {cache.bytes / 1e6:.1f} MB"
    )


def resident_mb() -> float:
    for row in Path("/proc/self/status").read_text(encoding="ascii").splitlines():
        if row.startswith("VmRSS:"):
            return int(row.split()[1]) / 1024
    raise AssertionError("no VmRSS in /proc/self/status")


def quality_seconds() -> None:
    print("\nleave-one-out error")
    for count, side in ((30, 5.0), (1_000, 50.0), (20_000, 200.0)):
        tags: tuple[TagState, ...] = store_of(scattered(count, side)).snapshot(0, "map").tags

        def judge() -> object:
            return leave_one_out(
                tags,  # noqa: B023  # run at once
                "temperature",
                falloff_radius_m=REACH_M,
                max_distance_m=REACH_M,
                power=2.0,
            )

        line(f"{count} tags, {side:g} m", best_of(judge, at_most=20))


def main() -> None:
    """Print every table."""
    print(f"Python {sys.version.split()[0]}, numpy {np.__version__}")
    compare_fields()
    other_rules()
    explored_masks()
    compare_far_corner()
    compare_hits()
    slide_box()
    quality_seconds()


if __name__ == "__main__":
    main()
