"""How right the fields are: against the simulator, which knows every value everywhere.

One full pass of the patrol, through the real messages and the real store, then the field of each
sensor in 0.05 m cells over the house, compared with the simulator's noise-free truth at the end of
the pass. `drift` is the part of the error that is only age: a pass takes three quarters of a
simulated hour. Without it (the day stands still) what is left is interpolation and sensor noise.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from builtin_interfaces.msg import Time
from greenhouse_sim.simulator import GreenhouseSimulator

from lupin_patrol import node as messages
from lupin_patrol.mission import FlowersSeen, Mission, PassCompleted, TagScanned, TagsDiscovered
from lupin_twin.core import ingest
from lupin_twin.core.drops import Drop
from lupin_twin.core.history import History
from lupin_twin.core.parameters import TwinParameters
from lupin_twin.core.state import TwinStore
from lupin_twin.field.engine import FieldCache, FieldEngine, FieldJob, FieldRequest, FieldRules
from lupin_twin.field.grid import FieldGrid, cell_centres
from lupin_twin.field.quality import leave_one_out, painted_share
from lupin_twin.ros import convert
from tests.support.climate import Truth

WIDTH_M, HEIGHT_M, CELL_M = 4.0, 8.0, 0.05
RULES = FieldRules.of(TwinParameters())


def after_one_pass(day_speed: float) -> tuple[TwinStore, float]:
    """The store after the first pass, and the simulated time of day then (s)."""
    store = TwinStore()
    time_of_day_s = 0.0
    for event in Mission(GreenhouseSimulator(), seed=0, day_speed=day_speed).events():
        stamp = Time(sec=int(event.at_s) + 1)
        if isinstance(event, TagScanned):
            time_of_day_s = event.time_of_day_s
            write(store, messages.tag_reading(event, stamp, "map"))
        elif isinstance(event, FlowersSeen):
            write(store, messages.inspection(event, stamp, "map"))
        elif isinstance(event, TagsDiscovered):
            pin_all(store, messages.discovered_tags(event, stamp, "map"))
        elif isinstance(event, PassCompleted):
            break
    return store, time_of_day_s


def write(store: TwinStore, msg: Any) -> None:
    made = ingest.observation(convert.received(msg), "map", 10**18)
    assert not isinstance(made, Drop)
    ingest.apply(made, store, History())


def pin_all(store: TwinStore, msg: Any) -> None:
    for pin in ingest.discoveries(convert.received_tags(msg), "map", store.is_pinned):
        assert not isinstance(pin, Drop)
        ingest.apply(pin, store, History())


def field_of(store: TwinStore, sensor: str) -> FieldGrid:
    request = FieldRequest(sensor, CELL_M, 0.0, 0.0, WIDTH_M, HEIGHT_M)
    answer = FieldEngine(RULES, FieldCache(0)).lookup(request, store, None)
    return answer.compute() if isinstance(answer, FieldJob) else answer


def errors(grid: FieldGrid, truth_of: Truth, sensor: str, time_of_day_s: float) -> Any:
    """Field less truth, cell by cell, of the painted cells."""
    xs = cell_centres(grid.origin_x, grid.width, grid.resolution)
    ys = cell_centres(grid.origin_y, grid.height, grid.resolution)
    truth = np.array(
        [[truth_of.of(sensor, (float(x), float(y)), time_of_day_s) for x in xs] for y in ys]
    )
    difference = grid.values.reshape(truth.shape) - truth
    return difference[np.isfinite(difference)], truth


def main() -> None:
    simulator = GreenhouseSimulator()
    truth_of = Truth(simulator)
    moving, at_the_end = after_one_pass(day_speed=60.0)
    still, standing = after_one_pass(day_speed=0.0)
    print("\nFields after one full pass against the simulator's truth, 0.05 m cells, 4 x 8 m")
    print(
        f"{'sensor':<14}{'tags':>5}{'painted':>9}{'RMSE':>9}{'of spread':>10}"
        f"{'without drift':>14}{'leave-one-out':>14}"
    )
    for sensor in simulator.sensors():
        grid = field_of(moving, sensor)
        off, truth = errors(grid, truth_of, sensor, at_the_end)
        off_still, _ = errors(field_of(still, sensor), truth_of, sensor, standing)
        judged = leave_one_out(
            moving.snapshot(0, "map").tags,
            sensor,
            falloff_radius_m=RULES.falloff_radius_m,
            max_distance_m=RULES.max_distance_m,
            power=RULES.idw_power,
        )
        rmse = float(np.sqrt(np.mean(off**2)))
        print(
            f"{sensor:<14}{grid.sample_count:>5}{painted_share(grid):>9.0%}{rmse:>9.2f}"
            f"{rmse / float(np.ptp(truth)):>10.0%}"
            f"{float(np.sqrt(np.mean(off_still**2))):>14.2f}"
            f"{judged.rmse if judged.rmse is not None else float('nan'):>14.2f}"
        )


if __name__ == "__main__":
    main()
