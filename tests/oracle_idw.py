"""The field by DESIGN.md's definition, as the simplest double loop: the reference of the tests.

Nothing here is fast and nothing is shared with `lupin_twin.field.idw`.
"""

import math
from collections.abc import Sequence

COINCIDENT_M = 0.001


def field_by_loop(
    samples: Sequence[tuple[float, float, float]],
    *,
    width: int,
    height: int,
    bbox_min_x: float,
    bbox_min_y: float,
    resolution: float,
    explored: Sequence[Sequence[bool]] | None = None,
    **rules: float,
) -> list[float]:
    """The cells' values, row by row from `bbox_min_y` up; `rules` as for `value_at`."""
    values = []
    for row in range(height):
        y = bbox_min_y + (row + 0.5) * resolution
        for column in range(width):
            x = bbox_min_x + (column + 0.5) * resolution
            is_known = explored is None or explored[row][column]
            values.append(value_at((x, y), samples, **rules) if is_known else math.nan)
    return values


def value_at(
    point: tuple[float, float],
    samples: Sequence[tuple[float, float, float]],
    *,
    falloff_radius_m: float,
    max_distance_m: float,
    power: float,
) -> float:
    """Rules 2 to 5 of the definition at one point."""
    distances = []
    for x, y, _ in samples:
        dx, dy = x - point[0], y - point[1]
        distances.append(math.sqrt(dx * dx + dy * dy))
    nearest = min(distances, default=math.inf)
    if nearest > max_distance_m:
        return math.nan
    # Of equally near samples the first one counts.
    nearest_value = samples[distances.index(nearest)][2]
    if nearest < COINCIDENT_M:
        return nearest_value
    weighted_sum = weight_sum = 0.0
    for distance, (_, _, value) in zip(distances, samples, strict=True):
        if distance <= falloff_radius_m:
            # 1/dᵖ times a constant of the cell: the quotient is the same, and cannot overflow.
            weight = (nearest / distance) ** power
            weighted_sum += weight * value
            weight_sum += weight
    return weighted_sum / weight_sum if weight_sum else nearest_value
