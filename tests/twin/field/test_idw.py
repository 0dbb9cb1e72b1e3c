"""The field rule by rule, its grid, and its refusals; see also `test_idw_definition`."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from lupin_twin.field.grid import FieldGrid
from lupin_twin.field.idw import COINCIDENT_EPS_M, compute_idw_field

Sample = tuple[float, float, float]

# One cell whose centre is exactly the origin.
UNIT_CELL: dict[str, Any] = {
    "bbox_min_x": -0.5,
    "bbox_min_y": -0.5,
    "bbox_max_x": 0.5,
    "bbox_max_y": 0.5,
    "resolution": 1.0,
}


def field_at_origin(samples: Sequence[Sample], **rules: Any) -> float:
    """The one value of a field of one cell, centred on the origin."""
    defaults = {"falloff_radius_m": 1.5, "max_distance_m": 1.5, "power": 2.0}
    grid = compute_idw_field(samples, **UNIT_CELL, **{**defaults, **rules})
    assert grid.values.shape == (1,)
    return float(grid.values[0])


def field_over(width: int, height: int, samples: Sequence[Sample], **changes: Any) -> FieldGrid:
    """A field over `width` x `height` cells from the origin, 1 m each unless changed."""
    resolution = changes.pop("resolution", 1.0)
    defaults = {"falloff_radius_m": 1.5, "max_distance_m": 1.5, "power": 2.0}
    return compute_idw_field(
        samples,
        bbox_min_x=0.0,
        bbox_min_y=0.0,
        bbox_max_x=width * resolution,
        bbox_max_y=height * resolution,
        resolution=resolution,
        **{**defaults, **changes},
    )


@pytest.mark.parametrize("power", [2.0, 3.0])
@pytest.mark.parametrize("falloff", [0.0, 1.0, 1.5, 3.0])
def test_a_coincident_sample_is_taken_exactly(power: float, falloff: float) -> None:
    closer = math.nextafter(COINCIDENT_EPS_M, 0.0)
    samples = [(0.002, 0.0, 1e6), (closer, 0.0, 7.0)]
    assert field_at_origin(samples, falloff_radius_m=falloff, power=power) == 7.0


def test_equal_distances_tie_although_their_squares_differ_by_a_rounding() -> None:
    """The tie is between distances. These two are the same float64, and their squares are not."""
    first, second = (0.3, 1.1), (1.0, 0.55)
    scale = math.dist(first, (0, 0)) / math.dist(second, (0, 0))
    candidates = (
        (second[0] * scale * (1 + step * 2**-52), second[1] * scale) for step in range(-8, 9)
    )
    square = first[0] ** 2 + first[1] ** 2
    tied = [
        (x, y)
        for x, y in candidates
        if x * x + y * y < square and math.sqrt(x * x + y * y) == math.sqrt(square)
    ]
    assert tied
    for x, y in tied:
        samples = [(*first, 10.0), (x, y, 20.0)]
        assert field_at_origin(samples, falloff_radius_m=0.5, max_distance_m=2.0) == 10.0


@pytest.mark.parametrize("power", [2.0, 3.0])
def test_a_distance_equal_to_the_radius_is_within_although_its_square_is_not(power: float) -> None:
    """0.8 and 1.5 are the legs of a right triangle whose hypotenuse rounds to exactly 1.7."""
    assert 0.8 * 0.8 + 1.5 * 1.5 > 1.7 * 1.7
    assert math.sqrt(0.8 * 0.8 + 1.5 * 1.5) == 1.7
    gate = {"falloff_radius_m": 0.0, "max_distance_m": 1.7, "power": power}
    assert field_at_origin([(0.8, 1.5, 7.0)], **gate) == 7.0
    falloff = {"falloff_radius_m": 1.7, "max_distance_m": 3.0, "power": power}
    assert field_at_origin([(0.8, 1.5, 10.0), (1.5, 0.8, 20.0)], **falloff) == 15.0


def test_the_range_leaves_out_what_float32_cannot_hold() -> None:
    samples = [(0.5, 0.5, 1e39), (3.5, 0.5, 8.0), (6.5, 0.5, -1e39)]
    grid = field_over(7, 1, samples, max_distance_m=0.5, falloff_radius_m=0.5)
    assert (grid.values[0], grid.values[6]) == (math.inf, -math.inf)
    assert (grid.value_min, grid.value_max) == (8.0, 8.0)
    only = field_over(1, 1, samples[:1])
    assert (only.value_min, only.value_max) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"falloff_radius_m": -0.1}, r"falloff_radius_m is -0\.1, must not be less than 0"),
        ({"falloff_radius_m": math.nan}, "falloff_radius_m is nan, must be finite"),
        ({"max_distance_m": math.inf}, "max_distance_m is inf, must be finite"),
        ({"max_distance_m": -1.0}, r"max_distance_m is -1\.0, must not be less than 0"),
        ({"power": -2.0}, r"power is -2\.0, must not be less than 0"),
        ({"power": math.nan}, "power is nan, must be finite"),
        ({"explored_mask": np.ones((3, 2), dtype=np.bool_)}, r"shape \(3, 2\), must be bool"),
        ({"explored_mask": np.ones((2, 3))}, "float64 of shape"),
        ({"resolution": 0.0}, r"resolution is 0\.0 m, must be greater than 0"),
    ],
)
def test_rules_out_of_range_are_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        field_over(3, 2, [(0.0, 0.0, 1.0)], **changes)


@pytest.mark.parametrize(
    ("samples", "message"),
    [
        ([(0.0, 0.0, 1.0), (0.0, math.nan, 1.0)], r"samples\[1\]\.y is nan, must be finite"),
        ([(math.inf, 0.0, 1.0)], r"samples\[0\]\.x is inf"),
        ([(0.0, 0.0, -math.inf)], r"samples\[0\]\.value is -inf"),
        ([(0.0, 0.0)], "samples hold 2 numbers, must be 3 each of 1"),
    ],
)
def test_invalid_samples_are_refused(samples: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        field_over(3, 2, samples)
