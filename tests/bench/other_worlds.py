"""Twelve sorts of greenhouses that share nothing with the simulator, each hard in its own way.

A world is one sensor's truth over a floor and days on end, and a robot that reads it: in each
round every tag once, always in the same order. All begin plain (a level, a day, places that differ
by waves, weather, noise); each sort then adds what a model with smooth daily courses does not
expect.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
import numpy.typing as npt

from lupin_twin.estimate.kernel import Readings

HOUR_S: Final = 3_600.0
DAY_S: Final = 86_400.0
# Published figures are of these; constants were chosen on 0 to 3.
JUDGING: Final = range(1_000, 1_004)
_UNTIL_S: Final = 3 * DAY_S

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Chance = np.random.Generator
# The truth at positions (k, 2), m, and times (k,), s; readings of true values by tag and time.
Truth = Callable[[Floats, Floats], Floats]
Sensor = Callable[[Floats, Ints, Floats, Chance], Floats]


@dataclass(frozen=True)
class World:
    """One sensor of one greenhouse: `size_m` of the floor, tags `xy`, s of a round, sd of noise.

    `swing` is half of the whole greenhouse's daily change, `uneven` how far positions differ.
    """

    size_m: tuple[float, float]
    xy: Floats
    round_s: float
    noise: float
    swing: float
    uneven: float
    truth: Truth
    sensor: Sensor = field(repr=False, default=lambda values, *_: values)

    def read(self, until_s: float, seed: int) -> Readings:
        """What the robot has read up to `until_s`."""
        chance = np.random.default_rng([seed, 1])
        order = chance.permutation(len(self.xy))
        step_s = self.round_s / len(order)
        time_s: Floats = np.arange(int(until_s / step_s) + 1, dtype=np.float64) * step_s
        tag = order[np.arange(len(time_s)) % len(order)]
        values = self.sensor(self.truth(self.xy[tag], time_s), tag, time_s, chance)
        return Readings(time_s, tag, values + chance.normal(0.0, self.noise, len(tag)), self.xy)


def _plain(chance: Chance) -> World:
    size_m = float(chance.uniform(4.0, 8.0)), float(chance.uniform(6.0, 14.0))
    swing, uneven = chance.uniform(1.0, 4.0), chance.uniform(0.5, 2.0)
    always, daily = _waves(chance), _waves(chance)
    locally, phases = uneven * chance.uniform(0.0, 0.5), chance.uniform(0.0, 24.0, 2)
    weather = _course(chance, 3.0)
    clouds = swing * chance.uniform(0.0, 0.4)

    def truth(xy: Floats, at_s: Floats) -> Floats:
        greenhouse = 20.0 + swing * _day(at_s, phases[0]) + clouds * weather(at_s)
        place: Floats = uneven * always(xy) + locally * daily(xy) * _day(at_s, phases[1])
        return greenhouse + place

    return World(
        size_m,
        chance.uniform((0.0, 0.0), size_m, (int(chance.integers(10, 25)), 2)),
        float(chance.uniform(20.0, 60.0)) * 60.0,
        float(chance.uniform(0.05, 0.4)),
        float(swing),
        float(uneven),
        truth,
    )


def _day(at_s: Floats, phase_h: float, times: float = 1.0) -> Floats:
    result: Floats = np.sin(times * 2.0 * np.pi * (at_s / DAY_S + phase_h / 24.0))
    return result


def _waves(chance: Chance, stretch: tuple[float, float] = (1.0, 1.0)) -> Callable[[Floats], Floats]:
    """Four plane waves 3 to 12 m long, together of variance 1; `stretch` along x and y."""
    angle, length = chance.uniform(0.0, np.pi, 4), chance.uniform(3.0, 12.0, 4)
    turn = 2.0 * np.pi / length * np.stack((np.cos(angle), np.sin(angle))) / np.array([stretch]).T
    phase = chance.uniform(0.0, 2.0 * np.pi, 4)
    return lambda xy: np.cos(xy @ turn + phase).sum(axis=1) * 0.5**0.5


def _course(chance: Chance, memory_h: float) -> Callable[[Floats], Floats]:
    """A stationary course of variance 1 that forgets within that many hours."""
    at_s = np.arange(0.0, _UNTIL_S, 1_800.0)
    keeps = np.exp(-0.5 / memory_h)
    course = chance.normal(size=len(at_s))
    for step in range(1, len(at_s)):
        course[step] = keeps * course[step - 1] + (1.0 - keeps**2) ** 0.5 * course[step]
    return lambda when: np.interp(when, at_s, course)


def _near(chance: Chance, world: World, reach_m: float) -> Callable[[Floats], Floats]:
    """1 at a spot of the floor, less around it."""
    spot = chance.uniform((0.0, 0.0), world.size_m)
    return lambda xy: np.exp(-np.hypot(*(xy - spot).T) / reach_m)


def _with(world: World, more: Truth) -> World:
    truth = world.truth
    return replace(world, truth=lambda xy, at_s: truth(xy, at_s) + more(xy, at_s))


def _harmonic(chance: Chance, world: World) -> World:
    phase, share = chance.uniform(0.0, 24.0), chance.uniform(0.5, 1.0)
    return _with(world, lambda _, at_s: share * world.swing * _day(at_s, phase, 2.0))


def _heater(chance: Chance, world: World) -> World:
    near, period_s = _near(chance, world, 3.0), chance.uniform(1_800.0, 5_400.0)
    power, on = 1.5 * world.swing, chance.uniform(0.3, 0.7)

    def more(xy: Floats, at_s: Floats) -> Floats:
        is_on = (at_s % period_s < on * period_s) & (_day(at_s, 0.0) < 0.3)
        result: Floats = power * near(xy) * is_on
        return result

    return _with(world, more)


def _door(chance: Chance, world: World) -> World:
    near, opened_s = _near(chance, world, 2.0), chance.uniform(0.0, _UNTIL_S, 40)

    def more(xy: Floats, at_s: Floats) -> Floats:
        since_s = at_s[:, None] - opened_s
        cools = np.where(since_s > 0.0, np.exp(-since_s / 1_500.0), 0.0).sum(axis=1)
        result: Floats = -3.0 * world.uneven * near(xy) * np.minimum(cools, 1.5)
        return result

    return _with(world, more)


def _front(chance: Chance, world: World) -> World:
    begins_s = np.arange(0.0, _UNTIL_S, 8.0 * HOUR_S) + chance.uniform(0.0, 8.0 * HOUR_S)
    drops = chance.choice((-1.5, 1.5), len(begins_s)) * world.swing

    def more(xy: Floats, at_s: Floats) -> Floats:
        # It crosses the greenhouse in an hour.
        late_s = at_s - HOUR_S * xy[:, 1] / world.size_m[1]
        steps = 0.5 * (1.0 + np.tanh((late_s[:, None] - begins_s) / 900.0))
        result: Floats = steps @ drops
        return result

    return _with(world, more)


def _bias(chance: Chance, world: World) -> World:
    off = chance.normal(0.0, 0.5 * world.uneven, len(world.xy))
    return replace(world, sensor=lambda values, tag, *_: values + off[tag])


def _drift(chance: Chance, world: World) -> World:
    a_day = chance.normal(0.0, world.uneven, len(world.xy)) * (chance.random(len(world.xy)) < 0.3)
    return replace(world, sensor=lambda values, tag, at_s, _: values + a_day[tag] * at_s / DAY_S)


def _heavy_tails(_: Chance, world: World) -> World:
    return replace(
        world,
        noise=0.0,
        sensor=lambda values, tag, _, chance: (
            values + 1.5 * world.noise * chance.standard_t(2.0, len(tag))
        ),
    )


def _stuck(chance: Chance, world: World) -> World:
    stuck, since_s = chance.choice(len(world.xy), 2, replace=False), chance.uniform(0.0, DAY_S, 2)

    def read(values: Floats, tag: Ints, at_s: Floats, _: Chance) -> Floats:
        result = values.copy()
        for one, from_s in zip(stuck, since_s, strict=True):
            those = np.flatnonzero((tag == one) & (at_s >= from_s))
            result[those] = result[those[:1]]
        return result

    return replace(world, sensor=read)


def _anisotropy(chance: Chance, world: World) -> World:
    waves = _waves(chance, (0.35, 3.0))
    return _with(world, lambda xy, _: world.uneven * waves(xy))


def _wall(chance: Chance, world: World) -> World:
    at_x, phase = world.size_m[0] * chance.uniform(0.3, 0.7), chance.uniform(0.0, 24.0)

    def more(xy: Floats, at_s: Floats) -> Floats:
        behind = world.uneven * (2.0 + _day(at_s, phase))
        return np.where(xy[:, 0] > at_x, behind, 0.0)

    return _with(world, more)


def _lag(chance: Chance, world: World) -> World:
    """The robot's own sensor follows its surroundings slowly."""
    slow_s = world.round_s / len(world.xy) * chance.uniform(0.5, 1.5)

    def read(values: Floats, _: Ints, at_s: Floats, __: Chance) -> Floats:
        result = values.copy()
        for n in range(1, len(result)):
            keeps = np.exp(-(at_s[n] - at_s[n - 1]) / slow_s)
            result[n] = keeps * result[n - 1] + (1.0 - keeps) * values[n]
        return result

    return replace(world, sensor=read)


def _uneven_variance(chance: Chance, world: World) -> World:
    rough, fast = _waves(chance, (0.5, 0.5)), _course(chance, 1.0)

    def more(xy: Floats, at_s: Floats) -> Floats:
        by_day = np.maximum(_day(at_s, 0.0), 0.0)
        half = xy[:, 1] > world.size_m[1] / 2.0
        result: Floats = world.uneven * np.where(half, rough(xy), 0.0)
        return result + world.swing * 0.7 * by_day * fast(at_s)

    return _with(world, more)


def restless(world: World, since_s: float, seed: int) -> World:
    """The same world until its air begins to swing, within two hours and from place to place."""
    swings = _waves(np.random.default_rng([seed, 2]), (0.3, 0.3))

    def more(xy: Floats, at_s: Floats) -> Floats:
        swing = np.sin(2.0 * np.pi * at_s / 7_000.0) * (at_s > since_s)
        result: Floats = 10.0 * world.uneven * swings(xy) * swing
        return result

    return _with(world, more)


SORTS: Final[dict[str, Callable[[Chance, World], World]]] = {
    "second harmonic": _harmonic,
    "heater that switches": _heater,
    "door": _door,
    "cold front": _front,
    "bias of each tag": _bias,
    "drift": _drift,
    "heavy tails": _heavy_tails,
    "stuck sensors": _stuck,
    "anisotropy": _anisotropy,
    "wall": _wall,
    "lag": _lag,
    "non-stationary variance": _uneven_variance,
}


def world_of(sort: str, seed: int) -> World:
    """The same one every time."""
    chance = np.random.default_rng([seed, list(SORTS).index(sort)])
    return SORTS[sort](chance, _plain(chance))
