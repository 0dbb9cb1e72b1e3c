"""The node's parameters: names, defaults, ranges and meaning, in one table."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields
from typing import Any, Final


class ParameterError(ValueError):
    """A parameter out of its range; the message names it, its value and the limit."""


def _parameter(
    default: Any,
    description: str,
    low: float | None = None,
    high: float = math.inf,
    *,
    may_be_empty: bool = False,
) -> Any:
    return field(
        default=default,
        metadata={
            "description": description,
            "low": low,
            "high": high,
            "may_be_empty": may_be_empty,
        },
    )


@dataclass(frozen=True, slots=True)
class TwinParameters:
    """Every parameter of `lupin_twin`, checked at construction.

    Lengths are metres, rates hertz. Ranges are closed; a name must not be empty.

    Raises:
        ParameterError: a value of the wrong type, not finite, or out of its range.

    """

    observations_topic: str = _parameter(
        "floranova/observations", "topic of lupin_msgs/Observation to subscribe to"
    )
    discovered_tags_topic: str = _parameter(
        "perception/discovered_tags", "topic of lupin_msgs/DiscoveredTags to subscribe to"
    )
    map_topic: str = _parameter("map", "topic of nav_msgs/OccupancyGrid to subscribe to")
    state_topic: str = _parameter("twin/state", "topic of lupin_msgs/TwinState to publish")
    times_topic: str = _parameter(
        "twin/times", "topic of lupin_msgs/TwinTimes to publish right behind the state"
    )
    field_service_name: str = _parameter("twin/get_field", "name of the GetField service")
    state_publish_rate_hz: float = _parameter(
        1.0, "how often the state is published, by the steady clock", 0.01, 100.0
    )
    frame_id: str = _parameter("map", "the frame that every pose has to be in")
    buffer_len: int = _parameter(32, "scans kept per tag for its history", 1, 10_000)
    idw_power: float = _parameter(2.0, "exponent of the distance in the weights", 0.01, 100.0)
    idw_falloff_radius_m: float = _parameter(
        1.5, "tags up to this distance are averaged, m", 0.001, 10_000.0
    )
    idw_max_distance_m: float = _parameter(
        1.5, "a cell whose nearest tag is farther is NaN, m", 0.001, 10_000.0
    )
    clip_to_explored: bool = _parameter(
        False, "NaN wherever the latest map does not know the floor"
    )
    max_grid_cells: int = _parameter(1_000_000, "largest field served, cells", 1, 100_000_000)
    field_cache_mb: float = _parameter(64.0, "memory for computed fields, MB", 0.0, 100_000.0)

    journal: str = _parameter(
        "",
        "file that keeps what was observed; off: none; empty: the user's, by domain and namespace",
        may_be_empty=True,
    )
    journal_days: float = _parameter(
        90.0, "how long scans and looks are kept in the journal, days", 0.01, 36_500.0
    )
    journal_max_mb: float = _parameter(
        4000.0, "size past which the journal gives up its oldest scans, MB", 10.0, 1e7
    )

    def __post_init__(self) -> None:
        for spec in fields(self):
            value = _checked(spec.name, getattr(self, spec.name), spec.default, spec.metadata)
            object.__setattr__(self, spec.name, value)


def _checked(name: str, value: object, default: object, metadata: Any) -> object:
    expected: Final = type(default)
    # YAML and the command line read 2 as an integer; where a number is meant, so it is a number.
    if name == "journal" and value is False:
        value = "off"  # what YAML makes of a plain off
    if expected is float and type(value) is int:
        value = float(value)
    if type(value) is not expected:
        raise ParameterError(
            f"parameter {name} is {value!r} ({type(value).__name__}), expected {expected.__name__}"
        )
    if isinstance(value, str) and not value and not metadata["may_be_empty"]:
        raise ParameterError(f"parameter {name} is empty, expected a name")
    if isinstance(value, int | float) and not isinstance(value, bool):
        low, high = metadata["low"], metadata["high"]
        if not low <= value <= high:  # false for NaN too
            raise ParameterError(f"parameter {name} is {value}, expected {low} to {high}")
    return value


def describe(name: str) -> tuple[str, str]:
    """(description, allowed range) of a parameter, for `ros2 param describe` and the README."""
    spec = next(spec for spec in fields(TwinParameters) if spec.name == name)
    low, high = spec.metadata["low"], spec.metadata["high"]
    return spec.metadata["description"], "" if low is None else f"{low} to {high}"
