"""The file of sensors: what each is called, how it is drawn, and which values are good for plants.

Pure: text in, checked values out. Whoever replaces the file is told what is wrong with it and on
which line, before anything starts.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from lupin_bridge.judge.derived import DERIVED

MAX_SENSORS: Final = 64
MAX_SPECIES: Final = 64
MAX_TEXT: Final = 64
# Those that the page speaks beside English, which is the `label` itself.
LANGUAGES: Final = frozenset({"de", "es", "nl"})
_MAX_DIGITS: Final = 100


class SensorsError(ValueError):
    """What is wrong with a file of sensors; the message names line, field, value and limit."""


@dataclass(frozen=True, slots=True)
class Span:
    """From `low` to `high`, both included, in the sensor's unit."""

    low: float
    high: float

    @property
    def width(self) -> float:
        """How wide it is, in the sensor's unit; more than 0."""
        return self.high - self.low


@dataclass(frozen=True, slots=True)
class Ranges:
    """What a sensor should read: ideal, and critical outside the wider `critical`.

    None: outside of it nothing is wrong. Without `ideal` nothing is judged.
    """

    ideal: Span | None = None
    critical: Span | None = None


@dataclass(frozen=True, slots=True)
class Sensor:
    """One sensor. Hue in degrees, lightness in percent (HSL); `unit` is empty where not known."""

    name: str
    label: str
    unit: str
    hue: float
    lightness: float
    day: Ranges = Ranges()
    night: Ranges = Ranges()
    species: Mapping[str, tuple[Ranges, Ranges]] = field(default_factory=dict)

    def ranges(self, *, is_day: bool, species: str = "") -> Ranges:
        """What holds at a tag with such plants; of an unknown species, what holds for all."""
        day, night = self.species.get(species.lower(), (self.day, self.night))
        return day if is_day else night


@dataclass(frozen=True, slots=True)
class Sensors:
    """The whole file, `text` as it stands, for whoever asks for it."""

    by_name: Mapping[str, Sensor]
    fallback: Sensor
    saturation: float
    max_alpha: float
    text: str

    def named(self, name: str) -> Sensor:
        """A sensor; one that the file does not know has neither unit nor ranges."""
        known = self.by_name.get(name)
        if known is not None:
            return known
        other = self.fallback
        return Sensor(name, other.label or name, other.unit, other.hue, other.lightness)


def parse(text: str) -> Sensors:
    """The sensors of a file's text.

    Raises:
        SensorsError: it is no JSON, or says what cannot be.

    """
    try:
        found = json.loads(
            text, parse_constant=_no_constant, parse_int=_whole, object_pairs_hook=_once
        )
    except json.JSONDecodeError as error:
        raise SensorsError(f"line {error.lineno}: {error.msg}") from None
    except RecursionError:
        raise SensorsError("it is nested too deeply for what it has to say") from None
    reader = _Reader(text)
    top = reader.table(found, (), _TOP)
    ramp = reader.table(top["ramp"], ("ramp",), _RAMP)
    entries = reader.table(top["sensors"], ("sensors",))
    if len(entries) > MAX_SENSORS:
        reader.fail(("sensors",), f"has {len(entries)} entries, the limit is {MAX_SENSORS}")
    return Sensors(
        by_name={
            name: reader.sensor(name, entry, ("sensors", name)) for name, entry in entries.items()
        },
        fallback=reader.sensor("", top["fallback"], ("fallback",)),
        saturation=reader.number(ramp["saturation"], ("ramp", "saturation"), 0, 100),
        max_alpha=reader.number(ramp["max_alpha"], ("ramp", "max_alpha"), 0, 1),
        text=text,
    )


def _no_constant(name: str) -> float:
    raise SensorsError(f"{name} is no number of JSON")


def _whole(digits: str) -> float:
    """Of so many digits that none fits any limit, Python would not make a whole number."""
    return int(digits) if len(digits) <= _MAX_DIGITS else float(digits)


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Of a key that is there twice, JSON takes the last and says nothing."""
    table: dict[str, Any] = {}
    for key, value in pairs:
        if key in table:
            raise SensorsError(_printable(f"{key[:MAX_TEXT]} is given more than once"))
        table[key] = value
    return table


def _printable(text: str) -> str:
    """JSON can spell half of a pair of UTF-16, which is no character."""
    return text.encode("utf-8", "backslashreplace").decode()


_IDEAL: Final = frozenset({"ideal"})
_CRITICAL: Final = frozenset({"critical"})
_BY_DAY: Final = frozenset({"critical", "night"})
_LOOK: Final = frozenset({"label", "unit", "hue", "lightness"})
_TOP: Final = frozenset({"ramp", "fallback", "sensors"})
_RAMP: Final = frozenset({"saturation", "max_alpha"})
_PATH = tuple[str, ...]


class _Reader:
    def __init__(self, text: str) -> None:
        self._text = text

    def sensor(self, name: str, entry: Any, path: _PATH) -> Sensor:
        table = self.table(entry, path, _LOOK | _IDEAL, _BY_DAY | {"species", "derived", "labels"})
        self._derived(name, table.get("derived", False), path)
        self._labels(table.get("labels", {}), (*path, "labels"))
        day, night = self._day_and_night(table, path)
        species = self.table(table.get("species", {}), (*path, "species"))
        if len(species) > MAX_SPECIES:
            self.fail((*path, "species"), f"has {len(species)} entries, the limit is {MAX_SPECIES}")
        known: set[str] = set()
        for kind in species:
            if kind.lower() in known:
                self.fail((*path, "species", kind), "is given more than once: case does not count")
            known.add(kind.lower())
        return Sensor(
            name=name,
            label=self.text(table["label"], (*path, "label")),
            unit=self.text(table["unit"], (*path, "unit")),
            hue=self.number(table["hue"], (*path, "hue"), 0, 360),
            lightness=self.number(table["lightness"], (*path, "lightness"), 0, 100),
            day=day,
            night=night,
            species={
                kind.lower(): self._of_species(ranges, (*path, "species", kind))
                for kind, ranges in species.items()
            },
        )

    def _derived(self, name: str, told: Any, path: _PATH) -> None:
        """Whoever reads the file knows from it alone what tags can have readings of."""
        if told is (name in DERIVED):
            return
        where = (*path, "derived")
        if name in DERIVED:
            self.fail(where, f"is {_short(told)}, not true: {name} is computed here")
        computed = ", ".join(sorted(DERIVED))
        self.fail(where, f"is {_short(told)}, not false: computed are {computed} alone")

    def _labels(self, entry: Any, path: _PATH) -> None:
        """For who reads the file: what the sensor is called in other languages, some or all."""
        labels = self.table(entry, path)
        for language, label in labels.items():
            at = (*path, language)
            if language not in LANGUAGES:
                self.fail(at, f"is not known here; known are {', '.join(sorted(LANGUAGES))}")
            if self.text(label, at) == "":
                self.fail(at, "is empty; leave it out to show the label")

    def _of_species(self, entry: Any, path: _PATH) -> tuple[Ranges, Ranges]:
        return self._day_and_night(self.table(entry, path, _IDEAL, _BY_DAY), path)

    def _day_and_night(self, table: Mapping[str, Any], path: _PATH) -> tuple[Ranges, Ranges]:
        """Of a night that says nothing, what holds by day."""
        day = self._ranges(table, path)
        if "night" not in table:
            return day, day
        at = (*path, "night")
        return day, self._ranges(self.table(table["night"], at, _IDEAL, _CRITICAL), at)

    def _ranges(self, table: Mapping[str, Any], path: _PATH) -> Ranges:
        ideal = self._span(table["ideal"], (*path, "ideal"))
        critical = self._span(table.get("critical"), (*path, "critical"))
        if critical is not None:
            if ideal is None:
                self.fail((*path, "critical"), "is given, but no ideal range")
            elif not (critical.low <= ideal.low and ideal.high <= critical.high):
                self.fail((*path, "critical"), f"is {_said(critical)}, inside ideal {_said(ideal)}")
        return Ranges(ideal, critical)

    def _span(self, value: Any, path: _PATH) -> Span | None:
        if value is None:
            return None
        if not isinstance(value, list) or len(value) != 2:
            self.fail(path, f"is {_short(value)}, not [low, high] or null")
        low, high = (self.number(each, path, -1e9, 1e9) for each in value)
        if not low < high:
            self.fail(path, f"is {_short(value)}, and low must be less than high")
        return Span(low, high)

    def table(
        self,
        value: Any,
        path: _PATH,
        needed: frozenset[str] = frozenset(),
        may: frozenset[str] = frozenset(),
    ) -> dict[str, Any]:
        """A JSON object with just these keys; with any, where none are needed."""
        if not isinstance(value, dict):
            self.fail(path, f"is {_short(value)}, not an object")
        for key in sorted(needed - value.keys()):
            self.fail(path, f"has no {key!r}")
        if needed:
            known = needed | may
            for key in value.keys() - known:
                these = ", ".join(sorted(known))
                self.fail((*path, key), f"is not known here; known are {these}")
        for key in value:
            if not _is_text(key):
                self.fail((*path, key), "is a name with half a character in it")
        table: dict[str, Any] = value
        return table

    def text(self, value: Any, path: _PATH) -> str:
        if not isinstance(value, str) or len(value) > MAX_TEXT:
            self.fail(path, f"is {_short(value)}, not a text of at most {MAX_TEXT} characters")
        if not _is_text(value):
            self.fail(path, f"is {_short(value)}, with half a character in it")
        return str(value)

    def number(self, value: Any, path: _PATH, low: float, high: float) -> float:
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        if not (is_number and low <= value <= high):
            self.fail(path, f"is {_short(value)}, not a number from {low:.15g} to {high:.15g}")
        return float(value)

    def fail(self, path: _PATH, why: str) -> Any:
        where = ".".join(key[:MAX_TEXT] for key in path) or "the file"
        raise SensorsError(_printable(f"line {self._line(path)}: {where} {why}"))

    def _line(self, path: _PATH) -> int:
        """The line on which the last key of a path stands, found key after key."""
        at = 0
        for key in path:
            spelled = rf"{re.escape(json.dumps(key, ensure_ascii=False))}\s*:"
            found = re.compile(spelled).search(self._text, at)
            if found is None:
                break
            at = found.end()
        return self._text.count("\n", 0, at) + 1


def _is_text(text: str) -> bool:
    """Whether it can be written as UTF-8, as all answers are."""
    return _printable(text) == text


def _said(span: Span) -> str:
    return f"[{span.low:.15g}, {span.high:.15g}]"


def _short(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= 60 else text[:57] + "..."
