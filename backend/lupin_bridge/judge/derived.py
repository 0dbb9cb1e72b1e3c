"""Quantities that growers steer by, out of what was measured at one place and moment. Pure.

Saturation vapour pressure: Tetens in the form of FAO Irrigation and Drainage Paper 56 (Allen et
al., 1998), equation 11: es = 0.6108 exp(17.27 T / (T + 237.3)) kPa, T in °C. Deficit: equations 19
and 26, for one place and moment. Dew point: equation 11 solved for T.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

_A: Final = 17.27
_B_C: Final = 237.3
_E0_KPA: Final = 0.6108
# Beyond this the formula means nothing, and no greenhouse is.
_COLDEST_C, _HOTTEST_C = -40.0, 80.0
# A sensor in saturated air reads up to this; it is taken for 100 %.
_SATURATED_PERCENT: Final = 105.0

TEMPERATURE: Final = "temperature"
HUMIDITY: Final = "humidity"


def saturation_kpa(temperature_c: float) -> float:
    """Vapour pressure (kPa) of saturated air at a temperature (°C)."""
    return _E0_KPA * math.exp(_A * temperature_c / (temperature_c + _B_C))


def vapour_pressure_deficit_kpa(temperature_c: float, humidity_percent: float) -> float:
    """What the air could still take up, kPa; NaN for what cannot be (humidity outside 0 to 105)."""
    if not _is_air(temperature_c, humidity_percent):
        return math.nan
    return saturation_kpa(temperature_c) * (1.0 - min(humidity_percent, 100.0) / 100.0)


def dew_point_c(temperature_c: float, humidity_percent: float) -> float:
    """The temperature (°C) at which dew falls; NaN for what cannot be, and for dry air."""
    share = min(humidity_percent, 100.0) / 100.0
    # The share and not the percentage: that of the least number above 0 is 0.
    if not _is_air(temperature_c, humidity_percent) or share == 0.0:
        return math.nan
    over = math.log(share) + _A * temperature_c / (temperature_c + _B_C)
    return _B_C * over / (_A - over)


def _is_air(temperature_c: float, humidity_percent: float) -> bool:
    is_humid = 0.0 <= humidity_percent <= _SATURATED_PERCENT
    return _COLDEST_C <= temperature_c <= _HOTTEST_C and is_humid


@dataclass(frozen=True, slots=True)
class Derived:
    """One derived quantity: what it is made of, in the order of `formula`'s arguments."""

    name: str
    sources: tuple[str, str]
    formula: Callable[[float, float], float]


def condensation_margin_k(temperature_c: float, humidity_percent: float) -> float:
    """By how much air may cool (K) before dew falls; NaN for what cannot be, and for dry air.

    On a surface that is colder than the air by more than this, water condenses.
    """
    return temperature_c - dew_point_c(temperature_c, humidity_percent)


VPD: Final = Derived("vpd", (TEMPERATURE, HUMIDITY), vapour_pressure_deficit_kpa)
DEW_POINT: Final = Derived("dew_point", (TEMPERATURE, HUMIDITY), dew_point_c)
CONDENSATION_MARGIN: Final = Derived(
    "condensation_margin", (TEMPERATURE, HUMIDITY), condensation_margin_k
)
DERIVED: Final[Mapping[str, Derived]] = {
    each.name: each for each in (VPD, DEW_POINT, CONDENSATION_MARGIN)
}
