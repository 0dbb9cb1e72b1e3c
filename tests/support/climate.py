"""The truth in the simulated greenhouse, and the known part of its floor."""

from copy import deepcopy
from typing import Any

from greenhouse_sim.simulator import SensorRegistry

from lupin_patrol.greenhouse import Point
from lupin_patrol.perception import UNKNOWN, Grid, value_of


class Truth:
    """From the same dynamics as the readings. Pure: no chance, no state.

    Where a sensor is the largest of several noisy components, its readings lie above this on
    average wherever the components are close to each other.
    """

    def __init__(self, simulator: Any) -> None:
        quiet = deepcopy(simulator.sim_config)
        for components in quiet["sensors"].values():
            for component in components:
                component["noise_sigma"] = 0.0
        self._registry = SensorRegistry(quiet)

    def of(self, sensor: str, position: Point, time_of_day_s: float) -> float:
        return value_of(self._registry, sensor, position, time_of_day_s)


def known_in(grid: Grid) -> int:
    """How many cells of a map are known."""
    return len(grid.cells) - grid.cells.count(UNKNOWN.to_bytes(1, "little", signed=True))
