"""Parses the sensors file with pydantic: text in, `Sensors` out. Pure.

Import it only where a file is read: pydantic takes 6 MB.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cache
from typing import Annotated, Any

from annotated_types import Interval
from pydantic import ConfigDict, TypeAdapter, ValidationError

from lupin_bridge.judge.quantities import DAILY, DERIVED, Name, Sensor, Sensors, Share

MAX_TEXT = 64

# The sensors from which each quantity is derived.
_COMPUTED_OF = {
    **{name: derived.sources for name, derived in DERIVED.items()},
    **{name: (daily.sensor,) for name, daily in DAILY.items()},
}


class SensorsError(ValueError):
    """A sensors file is invalid; the message names field, limit and value."""


@dataclass
class _Ramp:
    saturation: Share
    max_alpha: Annotated[float, Interval(ge=0, le=1)]


@dataclass
class _File:
    # Also that of the dataclasses in it.
    __pydantic_config__ = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)

    ramp: _Ramp
    fallback: Sensor
    sensors: dict[str, Sensor]
    areas: dict[Name, list[Name]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name, sensor in self.sensors.items():
            if sensor.derived != (of := _COMPUTED_OF.get(name, ())):
                raise ValueError(
                    f"sensors.{name}.derived is {list(sensor.derived)}, and must be {list(of)}:"
                    f" computed here are {', '.join(sorted(_COMPUTED_OF))} alone"
                )
            species = {kind.lower(): ranges for kind, ranges in sensor.species.items()}
            if len(species) < len(sensor.species):
                raise ValueError(
                    f"sensors.{name}: a species is given more than once: case is ignored"
                )
            self.sensors[name] = replace(sensor, name=name, species=species)


@cache
def _adapter() -> TypeAdapter[Any]:
    return TypeAdapter(_File)


def parse(text: str) -> Sensors:
    """The sensors of a file's text.

    Raises:
        SensorsError: it is not JSON, or its content is invalid.

    """
    try:
        file: _File = _adapter().validate_json(text)
    except ValidationError as error:
        raise SensorsError(_said(error)) from None
    return Sensors(
        by_name=file.sensors,
        fallback=file.fallback,
        saturation=file.ramp.saturation,
        max_alpha=file.ramp.max_alpha,
        text=text,
        areas=file.areas,
    )


def _said(error: ValidationError) -> str:
    first = error.errors(include_url=False)[0]
    where = ".".join(str(part)[:MAX_TEXT] for part in first["loc"])
    shown = "" if isinstance(first["input"], dict | str) else f", not {first['input']!r:.60}"
    said = f"{where or 'the file'}: {first['msg'].removeprefix('Value error, ')}{shown}"
    # Names may contain any character, and the message must be one line.
    return "".join(sign if sign.isprintable() else ascii(sign)[1:-1] for sign in said)
