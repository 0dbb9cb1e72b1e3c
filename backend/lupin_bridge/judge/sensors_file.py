"""Parses the sensors file with pydantic: text in, `Sensors` out. Pure.

Import it only where a file is read: pydantic takes 6 MB.
"""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from lupin_bridge.judge.quantities import DAILY, DERIVED, Ranges, Sensor, Sensors, Span

MAX_TEXT = 64

_Name = Annotated[str, Field(max_length=MAX_TEXT)]
_Limit = Annotated[float, Field(ge=-1e9, le=1e9)]
_Share = Annotated[float, Field(ge=0, le=100)]
# The sensors from which each quantity is derived.
_COMPUTED_OF = {
    **{name: derived.sources for name, derived in DERIVED.items()},
    **{name: (daily.sensor,) for name, daily in DAILY.items()},
}
# The page's languages other than English, whose text is `label`.
Language = Literal["de", "es", "nl"]


class SensorsError(ValueError):
    """A sensors file is invalid; the message names field, limit and value."""


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)


class _Ranges(_Part):
    ideal: tuple[_Limit, _Limit] | None
    critical: tuple[_Limit, _Limit] | None = None

    @model_validator(mode="after")
    def _lie_inside(self) -> Self:
        for name in ("ideal", "critical", "plausible"):
            span = getattr(self, name, None)
            if span is not None and not span[0] < span[1]:
                raise ValueError(f"{name} is {list(span)}, and low must be less than high")
        if self.critical is not None:
            if self.ideal is None:
                raise ValueError("critical is given, but no ideal range")
            if not (self.critical[0] <= self.ideal[0] and self.ideal[1] <= self.critical[1]):
                raise ValueError(
                    f"critical is {list(self.critical)}, inside ideal {list(self.ideal)}"
                )
        return self

    def made(self) -> Ranges:
        return Ranges(
            None if self.ideal is None else Span(*self.ideal),
            None if self.critical is None else Span(*self.critical),
        )


class _DayAndNight(_Ranges):
    night: _Ranges | None = None

    def by_day_and_night(self) -> tuple[Ranges, Ranges]:
        """The ranges by day and by night; without `night`, those of the day hold by night too."""
        return self.made(), (self.night or self).made()


class _Sensor(_DayAndNight):
    label: _Name
    unit: _Name
    hue: Annotated[float, Field(ge=0, le=360)]
    lightness: _Share
    # For readers of the file: the name in other languages, and the sensors it is derived from.
    labels: dict[Language, Annotated[_Name, Field(min_length=1)]] = {}
    derived: tuple[_Name, ...] = ()
    # What a working sensor can read; and the source of these numbers.
    plausible: tuple[_Limit, _Limit] | None = None
    source: str = ""
    species: dict[str, _DayAndNight] = {}

    @model_validator(mode="after")
    def _names_each_species_once(self) -> Self:
        if len({kind.lower() for kind in self.species}) < len(self.species):
            raise ValueError("a species is given more than once: case is ignored")
        return self

    def named(self, name: str) -> Sensor:
        day, night = self.by_day_and_night()
        species = {kind.lower(): it.by_day_and_night() for kind, it in self.species.items()}
        return Sensor(
            name,
            self.label,
            self.unit,
            self.hue,
            self.lightness,
            day,
            night,
            species,
            None if self.plausible is None else Span(*self.plausible),
        )


class _Ramp(_Part):
    saturation: _Share
    max_alpha: Annotated[float, Field(ge=0, le=1)]


class _File(_Part):
    ramp: _Ramp
    fallback: _Sensor
    sensors: dict[str, _Sensor]
    areas: dict[_Name, list[_Name]] = {}

    @model_validator(mode="after")
    def _check_derived(self) -> Self:
        for name, sensor in self.sensors.items():
            if sensor.derived != (of := _COMPUTED_OF.get(name, ())):
                raise ValueError(
                    f"sensors.{name}.derived is {list(sensor.derived)}, and must be {list(of)}:"
                    f" computed here are {', '.join(sorted(_COMPUTED_OF))} alone"
                )
        return self


def parse(text: str) -> Sensors:
    """The sensors of a file's text.

    Raises:
        SensorsError: it is not JSON, or its content is invalid.

    """
    try:
        file = _File.model_validate_json(text)
    except ValidationError as error:
        raise SensorsError(_said(error)) from None
    return Sensors(
        by_name={name: sensor.named(name) for name, sensor in file.sensors.items()},
        fallback=file.fallback.named(""),
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
