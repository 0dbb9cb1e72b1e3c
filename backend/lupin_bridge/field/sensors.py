"""What `sensors.json` says of each sensor: unit, label, colour. The HMI's build reads it too."""

from __future__ import annotations

import colorsys
import json
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any


@dataclass(frozen=True, slots=True)
class Sensor:
    """One sensor's presentation. Hue in degrees, saturation and lightness in percent (HSL)."""

    label: str
    unit: str
    hue: float
    saturation: float
    lightness: float

    @property
    def rgb(self) -> tuple[int, int, int]:
        """The sensor's one colour, 0 to 255 a channel (CSS Color 4, section 7: HSL to RGB)."""
        channels = colorsys.hls_to_rgb(self.hue / 360, self.lightness / 100, self.saturation / 100)
        red, green, blue = (round(channel * 255) for channel in channels)
        return red, green, blue


@cache
def _table() -> dict[str, Any]:
    text = files("lupin_bridge").joinpath("sensors.json").read_text(encoding="utf-8")
    table: dict[str, Any] = json.loads(text)
    return table


def max_alpha() -> float:
    """The heat map's opacity at `value_max`, 0 to 1; at `value_min` it is 0."""
    return float(_table()["ramp"]["max_alpha"])


def sensor(sensor_type: str) -> Sensor:
    """The presentation of a sensor; one that the file does not know has no unit."""
    table = _table()
    entry = table["sensors"].get(sensor_type, table["fallback"])
    return Sensor(
        label=entry["label"] or sensor_type,
        unit=entry["unit"],
        hue=entry["hue"],
        saturation=table["ramp"]["saturation"],
        lightness=entry["lightness"],
    )
