"""Sensors: what the one file says, as the bridge reads it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import lupin_bridge
from lupin_bridge.field.sensors import Sensor, max_alpha, sensor

FILE = json.loads((Path(lupin_bridge.__file__).parent / "sensors.json").read_text("utf-8"))


@pytest.mark.parametrize("name", FILE["sensors"])
def test_a_sensor_is_as_the_file_has_it(name: str) -> None:
    entry = FILE["sensors"][name]
    assert sensor(name) == Sensor(
        label=entry["label"],
        unit=entry["unit"],
        hue=entry["hue"],
        saturation=FILE["ramp"]["saturation"],
        lightness=entry["lightness"],
    )


@pytest.mark.parametrize("name", FILE["sensors"])
def test_every_sensor_has_a_hue_of_its_own_and_an_ideal_range(name: str) -> None:
    entry = FILE["sensors"][name]
    others = [other["hue"] for key, other in FILE["sensors"].items() if key != name]
    # 20 degrees apart, around the circle: colours that a person can tell from one another.
    assert all(20 <= abs(entry["hue"] - hue) <= 340 for hue in others)
    low, high = entry["ideal"]
    assert low < high


def test_a_sensor_that_the_file_does_not_know_has_its_own_name_and_no_unit() -> None:
    unknown = sensor("leaf_wetness")
    assert (unknown.label, unknown.unit, unknown.hue) == ("leaf_wetness", "", 265)


@pytest.mark.parametrize(
    ("hue", "saturation", "lightness", "rgb"),
    [  # worked examples of CSS Color 4, section 7
        (0, 100, 50, (255, 0, 0)),
        (120, 100, 25, (0, 128, 0)),
        (240, 100, 50, (0, 0, 255)),
        (60, 100, 50, (255, 255, 0)),
        (30, 50, 50, (191, 128, 64)),
        (200, 0, 40, (102, 102, 102)),
    ],
)
def test_a_colour_is_the_one_that_a_browser_shows(
    hue: float, saturation: float, lightness: float, rgb: tuple[int, int, int]
) -> None:
    assert Sensor("", "", hue, saturation, lightness).rgb == rgb


def test_the_ramp_ends_at_60_percent() -> None:
    assert max_alpha() == 0.6
