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
    falloff_radius_m: float,
    max_distance_m: float,
    power: float,
    explored: Sequence[Sequence[bool]] | None = None,
) -> list[float]:
    """The cells' values, row by row from `bbox_min_y` up."""
    values = []
    for row in range(height):
        cell_y = bbox_min_y + (row + 0.5) * resolution
        for column in range(width):
            cell_x = bbox_min_x + (column + 0.5) * resolution
            if explored is not None and not explored[row][column]:
                values.append(math.nan)
            else:
                values.append(
                    value_at(
                        (cell_x, cell_y),
                        samples,
                        falloff_radius_m=falloff_radius_m,
                        max_distance_m=max_distance_m,
                        power=power,
                    )
                )
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
    point_x, point_y = point
    distances = []
    nearest_distance = math.inf
    nearest_value = math.nan
    for x, y, value in samples:
        dx, dy = x - point_x, y - point_y
        distance = math.sqrt(dx * dx + dy * dy)
        distances.append(distance)
        if distance < nearest_distance:
            nearest_distance = distance
            nearest_value = value
    if nearest_distance > max_distance_m:
        return math.nan
    if nearest_distance < COINCIDENT_M:
        return nearest_value
    weighted_sum = 0.0
    weight_sum = 0.0
    for distance, (_, _, value) in zip(distances, samples, strict=True):
        if distance <= falloff_radius_m:
            # 1/dᵖ times a constant of the cell: the quotient is the same, and cannot overflow.
            weight = (nearest_distance / distance) ** power
            weighted_sum += weight * value
            weight_sum += weight
    if weight_sum == 0.0:
        return nearest_value
    return weighted_sum / weight_sum
