"""The node's parameters: names, defaults, ranges and meaning, in one table. Pure.

Also the launch file's arguments, and the parameters that they set. They are here so that tests do
not need `launch`, which is not on PyPI.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any, Final

from lupin_twin.core.diagnostics import Origin
from lupin_twin.core.drops import cut

# Largest allowed `max_pose_m`: a pose beyond it is far off in any greenhouse.
FARTHEST_M: Final = 1_000_000.0
# Names in a parameter that is a list.
MAX_NAMES: Final = 16
# An ordinary day, s.
DAY_S: Final = 86_400.0
# A century.
MAX_JOURNAL_DAYS: Final = 36_500.0
# Characters of a value that an error message repeats to the client that set it.
MAX_SHOWN: Final = 80


@dataclass(frozen=True, slots=True)
class World:
    """What a log notes of the observed greenhouse: its origin, and the twin's `day_length_s`."""

    origin: Origin = "robot"
    day_length_s: float = DAY_S


class ParameterError(ValueError):
    """A parameter or launch argument is invalid; the message names it, its value and the limit."""


@dataclass(frozen=True, slots=True)
class Described:
    """A parameter's description; `low` None: it has no range. `fixed`: why it may not change."""

    description: str
    low: float | None = None
    high: float = math.inf
    may_be_empty: bool = False
    fixed: str = ""

    @property
    def range(self) -> str:
        """The allowed range in words; empty if there is none."""
        return "" if self.low is None else f"{self.low} to {self.high}"


def _parameter(default: Any, description: str, *limits: float, **more: Any) -> Any:
    described = Described(description, *limits, **more)  # type: ignore[arg-type]  # two at most
    return field(default=default, metadata={"as": described})


# Reasons why a parameter is read only at the start.
_NAMED: Final = "other nodes already use this name: restart the twin"
_MEANING: Final = "existing data was accepted under it: restart the twin"
_MADE: Final = "memory and files were set up for it at the start: restart the twin"


@dataclass(frozen=True, slots=True)
class TwinParameters:
    """Every parameter of `lupin_twin`, checked at construction.

    Lengths are metres, rates hertz. Ranges are closed; a name must not be empty. In a list, empty
    names are ignored, because ROS cannot tell an empty list from an unset one. Parameters that are
    not `fixed` may be changed while the twin runs.

    Raises:
        ParameterError: a value of the wrong type, not finite, or out of its range.

    """

    observations_topic: str = _parameter(
        "floranova/observations", "topic of lupin_msgs/Observation to subscribe to", fixed=_NAMED
    )
    discovered_tags_topic: str = _parameter(
        "perception/discovered_tags",
        "topic of lupin_msgs/DiscoveredTags to subscribe to",
        fixed=_NAMED,
    )
    map_topic: str = _parameter(
        "map", "topic of nav_msgs/OccupancyGrid to subscribe to", fixed=_NAMED
    )
    state_topic: str = _parameter(
        "twin/state", "topic of lupin_msgs/TwinState to publish", fixed=_NAMED
    )
    field_service_name: str = _parameter(
        "twin/get_field", "name of the GetField service", fixed=_NAMED
    )
    state_publish_rate_hz: float = _parameter(
        1.0, "rate at which the state is published, Hz, by the steady clock", 0.01, 100.0
    )
    frame_id: str = _parameter("map", "frame that every pose must be in", fixed=_MEANING)
    max_pose_m: float = _parameter(
        1000.0,
        "a pose with a coordinate farther than this from the frame's origin is dropped, m",
        0.001,
        FARTHEST_M,
    )
    buffer_len: int = _parameter(32, "scans kept in the history of a tag", 1, 10_000, fixed=_MADE)
    idw_power: float = _parameter(2.0, "exponent of the distance in the weights", 0.01, 100.0)
    idw_falloff_radius_m: float = _parameter(
        1.5, "tags up to this distance are averaged, m", 0.001, 10_000.0
    )
    idw_max_distance_m: float = _parameter(
        1.5, "a cell farther than this from its nearest tag is NaN, m", 0.001, 10_000.0
    )
    clip_to_explored: bool = _parameter(
        default=False, description="whether a cell that is unknown on the map is NaN"
    )
    max_grid_cells: int = _parameter(
        1_000_000, "largest field served, cells", 1, 100_000_000, fixed=_MADE
    )
    field_cache_mb: float = _parameter(
        64.0, "size of the cache of fields, MB", 0.0, 100_000.0, fixed=_MADE
    )
    day_length_s: float = _parameter(
        DAY_S, "length of a day, s of ROS time; shorter in a simulation", 1.0, DAY_S, fixed=_MEANING
    )

    layers: tuple[str, ...] = _parameter(
        (), "sensors whose fields are published as points for viewers such as RViz", fixed=_NAMED
    )

    journal: str = _parameter(
        "",
        "file that records all observations; off: a temporary file; empty: this user's file for "
        "the ROS domain and namespace",
        may_be_empty=True,
        fixed=_MADE,
    )
    journal_days: float = _parameter(
        90.0,
        "how long the journal keeps scans and inspections, days",
        0.01,
        MAX_JOURNAL_DAYS,
        fixed=_MADE,
    )
    journal_max_mb: float = _parameter(
        4000.0, "size beyond which the journal deletes its oldest scans, MB", 10.0, 1e7, fixed=_MADE
    )

    def __post_init__(self) -> None:
        for spec in fields(self):
            value = _checked(spec.name, getattr(self, spec.name), spec.default, spec.metadata["as"])
            object.__setattr__(self, spec.name, value)


def _checked(name: str, value: object, default: object, described: Described) -> object:
    if isinstance(default, tuple):
        return _names(name, value)
    expected: Final = type(default)
    if name == "journal" and value is False:
        value = "off"  # YAML reads an unquoted off as False
    if expected is float and type(value) is int:
        value = float(value)  # YAML and the command line read 2 as an integer
    if type(value) is not expected:
        raise ParameterError(
            f"parameter {name} is {cut(repr(value), MAX_SHOWN)} ({type(value).__name__}), "
            f"expected {expected.__name__}"
        )
    if isinstance(value, str) and not value and not described.may_be_empty:
        raise ParameterError(f"parameter {name} is empty, expected a name")
    low, high = described.low or 0.0, described.high
    if isinstance(value, int | float) and not low <= value <= high:  # false for NaN too
        raise ParameterError(f"parameter {name} is {value}, expected {described.range}")
    return value


def _names(name: str, value: object) -> tuple[str, ...]:
    if value is None or isinstance(value, str):
        value = [value or ""]
    if not isinstance(value, list | tuple) or not all(isinstance(one, str) for one in value):
        raise ParameterError(
            f"parameter {name} is {cut(repr(value), MAX_SHOWN)}, expected a list of names"
        )
    names = tuple(filter(None, value))
    if len(names) > MAX_NAMES:
        raise ParameterError(
            f"parameter {name} is {len(names)} names, expected {MAX_NAMES} at most"
        )
    return names


def describe(name: str) -> Described:
    """Return what `ros2 param describe` and the docs show about a parameter."""
    described: Described = TwinParameters.__dataclass_fields__[name].metadata["as"]
    return described


def changed(now: TwinParameters, wanted: Mapping[str, object]) -> TwinParameters:
    """Return the parameters with some changed while the twin runs.

    Raises:
        ParameterError: a parameter is fixed, or its value is invalid.

    """
    for name, value in wanted.items():
        if why := describe(name).fixed:
            raise ParameterError(
                f"parameter {name} is {getattr(now, name)!r} and cannot become "
                f"{cut(repr(value), MAX_SHOWN)} while the twin runs: {why}"
            )
    return replace(now, **wanted)  # type: ignore[arg-type]  # checked there


# --- the launch file ------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Argument:
    """A launch argument; empty means: not given. `choices` None: any text."""

    name: str
    description: str
    default: str = ""
    choices: tuple[str, ...] | None = None


ARGUMENTS: Final = (
    Argument("namespace", "namespace of the node, its topics and its services, such as gh1"),
    Argument("params_file", "YAML file of parameters; not given: the package's config/twin.yaml"),
    Argument(
        "use_sim_time",
        "true: follow /clock; not given: as in the file of parameters",
        choices=("", "true", "false"),
    ),
    Argument(
        "journal",
        "file that records all observations; off: a temporary file; not given: as in the file of "
        "parameters",
    ),
    Argument(
        "layers",
        "sensors whose fields are published for RViz, separated by commas, such as "
        "temperature,humidity; not given: as in the file of parameters",
    ),
    Argument(
        "log_level",
        "debug, info, warn, error or fatal; or the level of one logger, such as rcl:=debug",
        default="info",
    ),
)


def overrides(given: Mapping[str, str]) -> dict[str, bool | str | list[str]]:
    """Return the parameters that given arguments set; these override the file."""
    values: dict[str, bool | str | list[str]] = {}
    if given["use_sim_time"]:
        values["use_sim_time"] = given["use_sim_time"] == "true"
    if given["journal"]:
        values["journal"] = given["journal"]
    if given["layers"]:
        values["layers"] = [name for part in given["layers"].split(",") if (name := part.strip())]
    return values


def params_file(given: Mapping[str, str], default: str, is_file: Callable[[str], bool]) -> str:
    """Return the path of the parameter file; `default` is the package's own.

    Raises:
        ParameterError: there is no such file; launch alone would warn, and start with defaults.

    """
    path = given["params_file"] or default
    if not is_file(path):
        raise ParameterError(f"params_file is {path!r}, expected an existing file")
    return path
