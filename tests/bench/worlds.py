"""Greenhouses that no prior was chosen on: the simulator's dynamics, other houses, other weather.

A world is one sensor's truth over a floor of 4 x 8 m and days on end, and a patrol that reads it: a
pass takes 45 minutes, every tag is read once in it, always in the same order.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from greenhouse_sim.simulator import GreenhouseSimulator, SensorRegistry

from lupin_patrol.climate import SECONDS_PER_DAY, Climate
from lupin_twin.estimate import Readings

WIDTH_M, HEIGHT_M = 4.0, 8.0
PASS_S: Final = 45 * 60.0
HOUR_S: Final = 3_600.0
# A cloud passes: what the whole house does beside its day, as a share of the day's swing.
_WEATHER_SHARE: Final = 0.3
_WEATHER_STEP_S: Final = 1_800.0
_WEATHER_HOURS: Final = 3.0

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class World:
    """One sensor of one house; `offset` is the weather, by time (s)."""

    name: str
    sensor: str
    climate: Climate
    xy: Floats
    order: tuple[int, ...]
    starts_s: float
    seed: int
    offset: Callable[[float], float]

    def truth(self, places: Floats, at_s: float) -> Floats:
        """Without noise, at places (k, 2), m."""
        at = at_s + self.starts_s
        return np.array(
            [self.climate.truth(self.sensor, (float(x), float(y)), at) for x, y in places]
        ) + self.offset(at_s)

    def scans(self, of_house: int, until_s: float) -> Readings:
        """What the patrol has read up to `until_s` where the house has `of_house` tags in all."""
        chance = random.Random(self.seed)
        times, tags, values = [], [], []
        step_s = PASS_S / of_house
        for turn in range(int(until_s / step_s) + 1):
            place = self.order[turn % of_house]
            if place >= len(self.xy):  # a tag without this sensor
                continue
            at_s = turn * step_s
            where = (float(self.xy[place, 0]), float(self.xy[place, 1]))
            at = at_s + self.starts_s
            ((_, value),) = self.climate.read((self.sensor,), where, at, chance)
            times.append(at_s)
            tags.append(place)
            values.append(value + self.offset(at_s))
        return Readings(np.array(times), np.array(tags, int), np.array(values), self.xy)


class _House:
    """What `Climate` takes of a simulator."""

    def __init__(self, config: dict[str, Any]) -> None:
        self.sim_config = config
        self.sensor_registry = SensorRegistry(config)

    def sensors(self) -> list[str]:
        return list(self.sim_config["sensors"])


def own(seeds: range) -> Iterator[tuple[World, int]]:
    """The simulator's own house, with other chance and another time of day."""
    simulator = GreenhouseSimulator()
    for seed in seeds:
        yield from _worlds(f"own {seed}", simulator, _own_tags(simulator), seed, has_weather=False)


def others(seeds: range, *, has_weather: bool = False) -> Iterator[tuple[World, int]]:
    """Houses with other sensors' courses, other places for the tags."""
    base = GreenhouseSimulator().sim_config
    for seed in seeds:
        chance = random.Random(f"house {seed}")
        config = {
            "sensors": {
                name: [_varied(one, chance) for one in components]
                for name, components in base["sensors"].items()
            }
        }
        kind = "weather" if has_weather else "house"
        tags = {name: _places(chance) for name in config["sensors"]}
        yield from _worlds(f"{kind} {seed}", _House(config), tags, seed, has_weather=has_weather)


def _worlds(
    name: str, house: Any, tags: dict[str, Floats], seed: int, *, has_weather: bool
) -> Iterator[tuple[World, int]]:
    chance = random.Random(f"tour {seed}")
    climate = Climate(house)
    of_house = 30
    for sensor in climate.sensors:
        order = list(range(of_house))
        chance.shuffle(order)
        starts_s = chance.uniform(0.0, SECONDS_PER_DAY)
        swing = _swing(house.sim_config["sensors"][sensor], sensor)
        offset = _weather(seed, sensor, swing) if has_weather else lambda _: 0.0
        yield (
            World(name, sensor, climate, tags[sensor], tuple(order), starts_s, seed, offset),
            of_house,
        )


def _own_tags(simulator: Any) -> dict[str, Floats]:
    tags = simulator.tag_manager.get_tags().values()
    return {
        sensor: np.array([(tag["x"], tag["y"]) for tag in tags if sensor in tag["sensors"]], float)
        for sensor in simulator.sensors()
    }


def _places(chance: random.Random) -> Floats:
    """Eight to twelve tags on the two tables of the house."""
    count = chance.randint(8, 12)
    return np.array([(chance.uniform(1.2, 2.8), chance.uniform(0.5, 7.5)) for _ in range(count)])


def _varied(component: dict[str, Any], chance: random.Random) -> dict[str, Any]:
    midnight, noon = component["value_at_midnight"], component["value_at_noon"]
    level, swing = chance.uniform(0.85, 1.15), chance.uniform(0.3, 1.5)
    return {
        **component,
        "value_at_midnight": midnight * level,
        "value_at_noon": (midnight + (noon - midnight) * swing) * level,
        "noise_sigma": component["noise_sigma"] * chance.uniform(0.5, 2.0),
        "decay_distance": component["decay_distance"] * chance.uniform(0.8, 2.0),
        "position": [chance.uniform(0.0, WIDTH_M), chance.uniform(0.0, HEIGHT_M)],
        "angle": chance.uniform(-90.0, 90.0),
        "dynamics": chance.choice(("radial", "linear", "uniform", component["dynamics"])),
    }


def _swing(components: list[dict[str, Any]], sensor: str) -> float:
    swing = max(abs(one["value_at_noon"] - one["value_at_midnight"]) for one in components)
    return float(swing) * (100.0 if sensor == "soil_moisture" else 1.0)


def _weather(seed: int, sensor: str, swing: float) -> Callable[[float], float]:
    """A stationary course of three hours' memory over four days."""
    chance = np.random.default_rng([seed, *sensor.encode()])
    steps = int(4 * SECONDS_PER_DAY / _WEATHER_STEP_S)
    keeps = float(np.exp(-_WEATHER_STEP_S / (_WEATHER_HOURS * HOUR_S)))
    course = np.zeros(steps)
    course[0] = chance.standard_normal()
    for step in range(1, steps):
        fresh = (1.0 - keeps**2) ** 0.5 * chance.standard_normal()
        course[step] = keeps * course[step - 1] + fresh
    course *= _WEATHER_SHARE * swing / 2.0
    at = np.arange(steps) * _WEATHER_STEP_S
    return lambda at_s: float(np.interp(at_s, at, course))
