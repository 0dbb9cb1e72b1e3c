"""The regular grid of every field: number of cells, cell centres, and which tags are far off.

Pure: numpy and the standard library only.

Positions and the resolution are metres in the map frame. Cell `(i, j)` is column `i` (along x) and
row `j` (along y), its centre lies at `bbox_min + (index + 0.5) * resolution`. Row 0 is at
`bbox_min_y`; `values` is row-major. NaN is "unknown" and never a reading.

A lost robot may pin a tag anywhere, and one such pin must not decide how wide the map is. The page
has the same rule (`domain/twin.ts`), and `tests/twin/core/far_off.json` tests both.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from fractions import Fraction
from statistics import median_low
from typing import Final

import numpy as np
import numpy.typing as npt

from lupin_twin.core.parameters import FARTHEST_M
from lupin_twin.core.state import TagState

_FLOAT32_MANTISSA_BITS: Final = 24
_FLOAT64_NOISE_ULPS: Final = 4

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class CellGrid:
    """A regular grid; its origin (m, map frame) is the corner of cell (0, 0), not the centre."""

    width: int
    height: int
    origin_x: float
    origin_y: float
    resolution: float


@dataclass(frozen=True, slots=True, eq=False)
class FieldGrid(CellGrid):
    """A reconstructed field.

    `values` is flat, row-major, float32 and read-only, NaN where nothing is known. `value_min` and
    `value_max` are those of the finite cells, both 0 if there are none. `sample_count` is the
    number of samples given, including those out of reach of the box.
    """

    values: npt.NDArray[np.float32]
    value_min: float
    value_max: float
    sample_count: int


def grid_dimensions(
    bbox_min_x: float,
    bbox_min_y: float,
    bbox_max_x: float,
    bbox_max_y: float,
    resolution: float,
) -> tuple[int, int]:
    """(width, height) in cells: each `max(1, ceil(extent / resolution))`, up to float noise.

    Box and resolution are metres. An exact multiple stays one although its numbers were rounded:
    1.1 m at 0.1 m is 11 cells, not 12, near the origin or far from it. That holds for float64, and
    for numbers that went through float32 as GetField's do; it is assumed if all of them fit into
    float32. The result never overflows; if it is too large to allocate, the caller has to refuse.

    Raises:
        ValueError: a number is not finite, the resolution is not positive, or the box is inverted.

    """
    # numpy's scalars would compute, and warn, in their own precision.
    box = (bbox_min_x, bbox_min_y, bbox_max_x, bbox_max_y, resolution)
    low_x, low_y, high_x, high_y, resolution = map(float, box)
    check_finite("resolution", resolution)
    if resolution <= 0.0:
        raise ValueError(f"resolution is {resolution} m, must be greater than 0")
    _check_side("x", low_x, high_x)
    _check_side("y", low_y, high_y)
    noise = (
        _noise_of_float32
        if all(map(_fits_float32, (low_x, low_y, high_x, high_y, resolution)))
        else _noise_of_float64
    )
    return (
        _cells_along(low_x, high_x, resolution, noise),
        _cells_along(low_y, high_y, resolution, noise),
    )


def _check_side(axis: str, low: float, high: float) -> None:
    check_finite(f"bbox_min_{axis}", low)
    check_finite(f"bbox_max_{axis}", high)
    if high < low:
        raise ValueError(
            f"bbox_max_{axis} is {high} m, must not be less than bbox_min_{axis} ({low} m)"
        )


def _cells_along(
    low: float, high: float, resolution: float, noise: Callable[[float], float]
) -> int:
    quotient = (high - low) / resolution
    if math.isinf(quotient):
        # Past float64: exact arithmetic still gives the size, so that it can be checked and named.
        return math.ceil((Fraction(high) - Fraction(low)) / Fraction(resolution))
    nearest = round(quotient)
    slack = (noise(low) + noise(high) + quotient * noise(resolution)) / resolution
    if abs(quotient - nearest) <= slack:
        return max(1, nearest)
    return max(1, math.ceil(quotient))


def _fits_float32(number: float) -> bool:
    mantissa, _ = math.frexp(number)
    return math.ldexp(mantissa, _FLOAT32_MANTISSA_BITS).is_integer()


def _noise_of_float32(number: float) -> float:
    """How far `number` may be off if it was rounded to float32: a unit in its last place."""
    return math.ldexp(1.0, math.frexp(number)[1] - _FLOAT32_MANTISSA_BITS) if number else 0.0


def _noise_of_float64(number: float) -> float:
    """How far a few operations in float64 may have moved `number`."""
    return _FLOAT64_NOISE_ULPS * math.ulp(number)


def cell_centres(low: float, count: int, resolution: float) -> FloatArray:
    """The centres (m) of `count` cells along one axis of a box that begins at `low` (m)."""
    centres: FloatArray = low + (np.arange(count, dtype=np.float64) + 0.5) * resolution
    return centres


def check_finite(name: str, number: float) -> None:
    """Raise ValueError, naming it, for a number that is not finite."""
    if not math.isfinite(number):
        raise ValueError(f"{name} is {number}, must be finite")


# No tag this near to the middle is far off: a site of 200 m may have most of its tags at one end.
_ALWAYS_NEAR_M: Final = 200.0
# Hampel's identifier: farther from the median than a multiple of the median distance (Davies and
# Gather, 1993). In a line of tags, the farthest are at twice the median, so this leaves room.
_SPREADS: Final = 10.0
# If more than one in three tags would be far off, they are a second site, and none is far off.
_ONE_IN: Final = 3


@dataclass(frozen=True, slots=True)
class Reach:
    """A circle around the middle of the tags; a tag outside is far off."""

    x: float
    y: float
    radius_m: float

    def holds(self, x: float, y: float) -> bool:
        """Whether a point (m, map frame) is inside."""
        is_possible = abs(x) <= FARTHEST_M and abs(y) <= FARTHEST_M
        return is_possible and math.hypot(x - self.x, y - self.y) <= self.radius_m


def reach_of(positions: Iterable[tuple[float, float]]) -> Reach:
    """The circle of the tags at these finite `positions` (x, y)."""
    everywhere = Reach(0.0, 0.0, math.inf)
    possible = [(x, y) for x, y in positions if everywhere.holds(x, y)]
    if not possible:
        return everywhere
    x, y = (median_low(axis) for axis in zip(*possible, strict=True))
    distances = [math.hypot(each_x - x, each_y - y) for each_x, each_y in possible]
    radius_m = max(_ALWAYS_NEAR_M, _SPREADS * median_low(distances))
    far = sum(distance > radius_m for distance in distances)
    return Reach(x, y, radius_m if far <= len(possible) // _ONE_IN else math.inf)


def far_off_tags(tags: Iterable[TagState]) -> list[str]:
    """The ids of the far-off ones among a snapshot's `tags`."""
    pinned = [(tag.tag_id, tag.pose.x, tag.pose.y) for tag in tags if tag.pose is not None]
    reach = reach_of((x, y) for _, x, y in pinned)
    return [tag_id for tag_id, x, y in pinned if not reach.holds(x, y)]
