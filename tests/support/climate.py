"""The truth in the simulated greenhouse, the known part of its floor, and its ordinary days."""

from copy import deepcopy
from dataclasses import replace
from typing import Any, Final

from greenhouse_sim.simulator import GreenhouseSimulator, SensorRegistry

from lupin_patrol.greenhouse import Point
from lupin_patrol.mission import DAYS, past
from lupin_patrol.perception import UNKNOWN, Grid, value_of
from lupin_twin.core.state import Observation, Pin
from tests.support.journal import past_write


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


S: Final = 1_000_000_000
DAY_NS: Final = 86_400 * S
_DAY_SPEED: Final = 60.0


def ordinary_days() -> list[Observation]:
    """Scans and inspections of three days, from 0 ns on, as a journal returns them."""
    rows = past(GreenhouseSimulator(), 0, _DAY_SPEED, 1.0, 0)
    reported = (row for row in rows if not isinstance(row, Pin))
    return [
        past_write(
            number, 1, replace(row, stamp_ns=DAYS * DAY_NS + round(row.stamp_ns * _DAY_SPEED))
        )
        for number, row in enumerate(reported, start=1)
    ]
