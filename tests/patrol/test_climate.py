"""What the sensors read, against the simulator's own formulas."""

from __future__ import annotations

import random
from statistics import fmean, stdev
from typing import Any

import pytest
from greenhouse_sim.simulator import GreenhouseSimulator

from lupin_patrol.plants import Climate, stream

NOON_S = 12 * 3600.0
ALL = ("temperature", "humidity", "co2", "light", "soil_moisture")


@pytest.fixture(scope="module")
def simulator() -> Any:
    return GreenhouseSimulator()


@pytest.fixture(scope="module")
def climate(simulator: Any) -> Climate:
    return Climate(simulator)


def test_the_sensors_are_the_simulators(climate: Climate) -> None:
    assert climate.sensors == ALL


def test_readings_come_in_the_order_asked_for_and_no_others(climate: Climate) -> None:
    readings = climate.read(("light", "co2"), (1.0, 1.0), NOON_S, stream(0))
    assert [name for name, _ in readings] == ["light", "co2"]


def test_readings_are_the_simulators_own_values_soil_moisture_in_percent(
    climate: Climate, simulator: Any
) -> None:
    for name in ALL:
        [(_, value)] = climate.read((name,), (1.3, 2.6), NOON_S, random.Random(5))
        random.seed(5)
        raw = simulator.sensor_registry.get_sensor(name).retrieve_data((1.3, 2.6), NOON_S)
        assert value == pytest.approx(raw * 100.0 if name == "soil_moisture" else raw)


def test_readings_repeat_with_the_same_chance_and_differ_with_another(climate: Climate) -> None:
    first = climate.read(ALL, (2.0, 2.0), NOON_S, stream(1, "scan"))
    random.seed(123)  # whatever else in the process draws numbers
    assert climate.read(ALL, (2.0, 2.0), NOON_S, stream(1, "scan")) == first
    assert climate.read(ALL, (2.0, 2.0), NOON_S, stream(2, "scan")) != first


def test_one_chance_gives_new_noise_at_each_reading(climate: Climate) -> None:
    chance = stream(1, "scan")
    first = climate.read(("co2",), (2.0, 2.0), NOON_S, chance)
    assert climate.read(("co2",), (2.0, 2.0), NOON_S, chance) != first


def test_reading_leaves_the_processs_random_numbers_alone(climate: Climate) -> None:
    random.seed(4)
    expected = random.random()
    random.seed(4)
    climate.read(ALL, (2.0, 2.0), NOON_S, stream(0))
    assert random.random() == expected


@pytest.mark.parametrize(
    ("sensor", "position", "hour", "expected"),
    [
        # On the centre of its radial part; the other part is more than its 2 m away.
        ("temperature", (2.0, 0.0), 12, 26.0),
        ("temperature", (2.0, 0.0), 0, 18.0),
        ("temperature", (2.0, 0.0), 6, 22.0),
        # Half the radial part's 10.67 m away.
        ("temperature", (2.0 + 10.67 / 2, 0.0), 12, 13.0),
        ("co2", (5.0, 3.0), 12, 800.0),
        ("co2", (5.0, 3.0 + 10.67), 12, 600.0),  # the uniform part
        ("light", (2.0, 4.0), 12, 1000.0),
        ("soil_moisture", (2.5, 7.0), 12, 80.0),
        ("soil_moisture", (2.5, 3.0), 12, 50.0),  # the uniform part
    ],
)
def test_the_truth_follows_the_configuration(
    climate: Climate, sensor: str, position: tuple[float, float], hour: float, expected: float
) -> None:
    assert climate.truth(sensor, position, hour * 3600.0) == pytest.approx(expected)


def test_the_truth_is_pure(climate: Climate) -> None:
    for name in ALL:
        value = climate.truth(name, (1.0, 6.0), NOON_S)
        assert all(climate.truth(name, (1.0, 6.0), NOON_S) == value for _ in range(5))


def test_the_day_wraps(climate: Climate) -> None:
    assert climate.truth("temperature", (1.0, 1.0), NOON_S + 86_400.0) == pytest.approx(
        climate.truth("temperature", (1.0, 1.0), NOON_S)
    )


def test_readings_scatter_around_the_truth(climate: Climate) -> None:
    # Where one component stands out, noise of 30 ppm around it is all there is.
    chance = stream(0, "many")
    values = [climate.read(("co2",), (5.0, 3.0), NOON_S, chance)[0][1] for _ in range(400)]
    assert fmean(values) == pytest.approx(climate.truth("co2", (5.0, 3.0), NOON_S), abs=6.0)
    assert stdev(values) == pytest.approx(30.0, rel=0.15)
    # The temperature has no noise at all.
    assert climate.read(("temperature",), (1.0, 1.0), 0.0, chance)[0][1] == climate.truth(
        "temperature", (1.0, 1.0), 0.0
    )
