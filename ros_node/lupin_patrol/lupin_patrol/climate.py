"""What the sensors read: the simulator's own dynamics, at our own time of day and chance.

Units are those of `lupin_msgs/SensorReading`: temperature °C, humidity % relative, co2 ppm,
light lx, soil_moisture %.
"""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from copy import deepcopy
from typing import Any

from greenhouse_sim.simulator import SensorRegistry

from lupin_patrol.geometry import Point

SECONDS_PER_DAY = 86_400.0

# The simulator gives soil moisture as a fraction, everything else in the contract's unit.
_TO_CONTRACT_UNIT = {"soil_moisture": 100.0}


class Climate:
    """The climate of one greenhouse, anywhere on its floor and at any time of day."""

    def __init__(self, simulator: Any) -> None:
        self._noisy = simulator.sensor_registry
        quiet = deepcopy(simulator.sim_config)
        for components in quiet["sensors"].values():
            for component in components:
                component["noise_sigma"] = 0.0
        self._quiet = SensorRegistry(quiet)
        self.sensors: tuple[str, ...] = tuple(simulator.sensors())

    def read(
        self,
        sensors: Sequence[str],
        position: Point,
        time_of_day_s: float,
        chance: random.Random,
    ) -> tuple[tuple[str, float], ...]:
        """Read sensors at a place (m, map) and time (s since midnight), noise included."""
        with _as_global_random(chance):
            return tuple(
                (name, _value(self._noisy, name, position, time_of_day_s)) for name in sensors
            )

    def truth(self, sensor: str, position: Point, time_of_day_s: float) -> float:
        """Return the value without noise, from the same dynamics. Pure: no chance, no state.

        Where a sensor is the largest of several noisy components, its readings lie above this on
        average wherever the components are close to each other.
        """
        return _value(self._quiet, sensor, position, time_of_day_s)


def _value(registry: Any, sensor: str, position: Point, time_of_day_s: float) -> float:
    value = registry.get_sensor(sensor).retrieve_data(position, time_of_day_s % SECONDS_PER_DAY)
    return float(value) * _TO_CONTRACT_UNIT.get(sensor, 1.0)


@contextmanager
def _as_global_random(chance: random.Random) -> Iterator[None]:
    """Let the simulator, which draws from the process's global stream, draw from `chance`."""
    outer = random.getstate()
    random.setstate(chance.getstate())
    try:
        yield
    finally:
        chance.setstate(random.getstate())
        random.setstate(outer)
