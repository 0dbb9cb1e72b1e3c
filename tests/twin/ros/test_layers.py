"""Fields as points: each known cell once, with its position and its error."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst
from rclpy.validate_topic_name import validate_topic_name

from lupin_twin.core.parameters import ParameterError
from lupin_twin.estimate.posterior import EstimateGrid
from lupin_twin.field.grid import FieldGrid
from lupin_twin.ros.layers import ERROR_UNKNOWN, points, topic_of, topics_of

SIDES = st.integers(1, 6)
CELLS = st.one_of(st.just(math.nan), st.just(math.inf), st.floats(-1e6, 1e6, width=32))


def field(values: np.ndarray[tuple[int, int], np.dtype[np.float32]]) -> FieldGrid:
    height, width = values.shape
    return FieldGrid(width, height, -1.5, 2.25, 0.5, values.reshape(-1), 0.0, 0.0, 1)


@given(st.data(), SIDES, SIDES)
def test_the_points_are_those_of_a_plain_loop(data: st.DataObject, width: int, height: int) -> None:
    grid = field(data.draw(npst.arrays(np.float32, (height, width), elements=CELLS)))
    numbers = npst.arrays(np.float32, (height, width), elements=st.floats(0, 1e3, width=32))
    mean, sd = data.draw(numbers), data.draw(numbers)
    known = np.ones((height, width), dtype=np.bool_)
    estimate = EstimateGrid(width, height, -1.5, 2.25, 0.5, mean, sd, known, 1.0)
    expected = []
    for row in range(height):
        for column in range(width):
            value = float(grid.values[row * width + column])
            if math.isfinite(value):
                x, y = -1.5 + (column + 0.5) * 0.5, 2.25 + (row + 0.5) * 0.5
                error = math.hypot(float(sd[row, column]), value - float(mean[row, column]))
                expected.append((x, y, 0.0, value, error))
    found = points(grid, estimate)
    assert found.dtype == np.dtype(np.float32)
    assert found.shape == (len(expected), 5)
    # Below the smallest normal number, float32 has fewer digits.
    least = float(np.finfo(np.float32).smallest_normal)
    np.testing.assert_allclose(found, np.array(expected).reshape(-1, 5), rtol=1e-5, atol=least)
    bare = points(grid, None)
    np.testing.assert_array_equal(bare[:, :4], found[:, :4])
    assert (bare[:, 4] == ERROR_UNKNOWN).all()


@pytest.mark.parametrize(
    ("sensor", "token"),
    [
        ("temperature", "temperature"),
        ("soil_moisture", "soil_moisture"),
        ("soil moisture", "soil_x20_moisture"),
        ("CO₂", "CO_x2082_"),
        ("a/b", "a_x2f_b"),
        ("2nd", "sensor_2nd"),
        ("_hidden", "sensor__hidden"),
    ],
)
def test_a_name_that_ros_does_not_accept_is_escaped(sensor: str, token: str) -> None:
    assert topic_of(sensor) == f"twin/field/{token}"


@given(st.text(min_size=1, max_size=20))
def test_every_sensor_has_a_valid_and_visible_topic(sensor: str) -> None:
    topic = topic_of(sensor)
    assert validate_topic_name(topic)
    assert topic.rpartition("/")[2][0].isalpha()


@pytest.mark.parametrize("sensors", [["a b", "co2", "a_x20_b"], ["co2", "co2"]])
def test_two_sensors_with_one_topic_are_refused_by_name(sensors: list[str]) -> None:
    message = f"parameter layers has '{sensors[0]}' and '{sensors[-1]}'"
    with pytest.raises(ParameterError, match=message):
        topics_of(sensors)
    assert topics_of(sensors[:-1]) == {topic_of(sensor): sensor for sensor in sensors[:-1]}
