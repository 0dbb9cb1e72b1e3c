import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lupin_bridge.judge.quantities import (
    DERIVED,
    dew_point_c,
    saturation_kpa,
    vapour_pressure_deficit_kpa,
)


@pytest.mark.parametrize(
    ("temperature_c", "kpa"),
    # FAO Irrigation and Drainage Paper 56, annex 2, table 2.3.
    [(1.0, 0.657), (10.0, 1.228), (15.0, 1.705), (20.0, 2.338), (25.0, 3.168), (30.0, 4.243)],
)
def test_saturation_matches_the_published_table(temperature_c: float, kpa: float) -> None:
    assert saturation_kpa(temperature_c) == pytest.approx(kpa, abs=0.001)


def test_the_deficit_is_what_the_air_can_still_take_up() -> None:
    assert vapour_pressure_deficit_kpa(20.0, 100.0) == 0.0
    assert vapour_pressure_deficit_kpa(20.0, 0.0) == saturation_kpa(20.0)
    assert vapour_pressure_deficit_kpa(25.0, 60.0) == pytest.approx(0.4 * 3.168, abs=0.001)


@given(st.floats(-39, 79), st.floats(0.5, 100))
def test_air_at_its_dew_point_is_saturated(temperature_c: float, humidity: float) -> None:
    dew_c = dew_point_c(temperature_c, humidity)
    assert dew_c <= temperature_c + 1e-9
    assert saturation_kpa(dew_c) == pytest.approx(saturation_kpa(temperature_c) * humidity / 100)


@pytest.mark.parametrize(
    ("temperature_c", "humidity"),
    [(20.0, -0.1), (20.0, 105.1), (-40.1, 50.0), (80.1, 50.0), (math.nan, 50.0), (20.0, math.nan)],
)
def test_impossible_readings_derive_nothing(temperature_c: float, humidity: float) -> None:
    for derived in DERIVED.values():
        assert math.isnan(derived.formula(temperature_c, humidity))


@pytest.mark.parametrize("humidity", [0.0, 5e-324, 2e-322])
def test_dry_air_has_no_dew_point(humidity: float) -> None:
    assert math.isnan(dew_point_c(20.0, humidity))


def test_a_sensor_that_reads_slightly_high_in_saturated_air_counts_as_saturated() -> None:
    assert vapour_pressure_deficit_kpa(20.0, 100.4) == 0.0
    assert dew_point_c(20.0, 105.0) == pytest.approx(20.0)
