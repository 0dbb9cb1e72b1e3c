from __future__ import annotations

import itertools
import json
import re
from importlib.resources import files
from typing import Any

import pytest

from lupin_bridge.judge.episodes import TagEpisodes
from lupin_bridge.judge.ranges import (
    LANGUAGES,
    MAX_SENSORS,
    MAX_TEXT,
    Ranges,
    SensorsError,
    Span,
    parse,
)
from lupin_twin.past_writes import PastWrite

GOOD: dict[str, Any] = {
    "ramp": {"saturation": 72, "max_alpha": 0.6},
    "fallback": {"label": "", "unit": "", "hue": 265, "lightness": 50, "ideal": None},
    "sensors": {
        "temperature": {
            "label": "Temperature",
            "unit": "°C",
            "hue": 8,
            "lightness": 50,
            "ideal": [18, 26],
            "critical": [10, 35],
            "night": {"ideal": [15, 24]},
            "species": {"Orchid": {"ideal": [20, 28], "night": {"ideal": None}}},
        }
    },
}


def text_with(path: str, value: Any) -> str:
    """The good file, indented, with one value replaced."""
    table = json.loads(json.dumps(GOOD))
    *way, last = path.split("/")
    at = table
    for key in way:
        at = at[key]
    if value is ...:
        del at[last]
    else:
        at[last] = value
    return json.dumps(table, indent=1)


def test_the_file_that_comes_with_the_bridge_is_good() -> None:
    text = files("lupin_bridge").joinpath("sensors.json").read_text(encoding="utf-8")
    sensors = parse(text)
    assert sensors.text == text
    assert sensors.named("temperature").unit == "°C"
    assert sensors.named("light").night == Ranges(None, None)
    assert {"vpd", "dew_point"} <= sensors.by_name.keys()


def test_the_file_says_what_is_derived() -> None:
    vpd = {"label": "", "unit": "kPa", "hue": 1, "lightness": 50, "ideal": None}
    with pytest.raises(SensorsError, match=r"sensors\.vpd\.derived is false, not true: vpd is"):
        parse(text_with("sensors/vpd", vpd))
    assert parse(text_with("sensors/vpd", vpd | {"derived": True})).named("vpd").unit == "kPa"
    with pytest.raises(SensorsError, match=r"derived is true, not false: computed are dew_point, "):
        parse(text_with("sensors/temperature/derived", True))
    with pytest.raises(SensorsError, match=r"derived is 1, not true"):
        parse(text_with("sensors/vpd", vpd | {"derived": 1}))


def test_every_sensor_has_a_hue_of_its_own() -> None:
    text = files("lupin_bridge").joinpath("sensors.json").read_text(encoding="utf-8")
    hues = [sensor.hue for sensor in parse(text).by_name.values()]
    # 20 degrees apart, around the circle: colours that a person can tell from one another.
    assert all(20 <= abs(a - b) <= 340 for a, b in itertools.combinations(hues, 2))


def test_the_ramp_ends_at_60_percent() -> None:
    text = files("lupin_bridge").joinpath("sensors.json").read_text(encoding="utf-8")
    assert parse(text).max_alpha == 0.6


def test_day_night_and_species_have_their_own_ranges() -> None:
    temperature = parse(json.dumps(GOOD)).named("temperature")
    assert temperature.ranges(is_day=True) == Ranges(Span(18, 26), Span(10, 35))
    assert temperature.ranges(is_day=False) == Ranges(Span(15, 24))
    assert temperature.ranges(is_day=True, species="rose") == temperature.ranges(is_day=True)
    assert temperature.ranges(is_day=True, species="orchid") == Ranges(Span(20, 28))
    assert temperature.ranges(is_day=False, species="ORCHID") == Ranges()


def test_a_night_that_says_nothing_is_as_the_day() -> None:
    temperature = parse(text_with("sensors/temperature/night", ...)).named("temperature")
    assert temperature.night == temperature.day


def test_a_sensor_that_nobody_declared_is_never_judged() -> None:
    ph = parse(json.dumps(GOOD)).named("ph")
    assert (ph.name, ph.label, ph.unit, ph.hue) == ("ph", "ph", "", 265)
    assert ph.ranges(is_day=True) == Ranges()


@pytest.mark.parametrize(
    ("path", "value", "says"),
    [
        ("ramp", ..., "line 1: the file has no 'ramp'"),
        ("ramp/max_alpha", 1.1, "line 4: ramp.max_alpha is 1.1, not a number from 0 to 1"),
        ("sensors/temperature/hue", 361, "temperature.hue is 361, not a number from 0 to 360"),
        ("sensors/temperature/hue", True, "temperature.hue is true, not a number"),
        ("sensors/temperature/label", ..., "temperature has no 'label'"),
        ("sensors/temperature/label", "x" * (MAX_TEXT + 1), "not a text of at most 64"),
        ("sensors/temperature/unit", 5, "temperature.unit is 5, not a text"),
        ("sensors/temperature/ideal", [26, 18], "ideal is [26, 18], and low must be less than"),
        ("sensors/temperature/ideal", [18, 18], "ideal is [18, 18], and low must be less than"),
        ("sensors/temperature/ideal", [18], "ideal is [18], not [low, high] or null"),
        ("sensors/temperature/ideal", "warm", 'ideal is "warm", not [low, high] or null'),
        ("sensors/temperature/critical", [19, 35], "is [19, 35], inside ideal [18, 26]"),
        ("sensors/temperature/critical", [19, 1e7], "is [19, 10000000], inside ideal [18, 26]"),
        ("sensors/temperature/critical", [10, 25], "is [10, 25], inside ideal [18, 26]"),
        ("sensors/temperature/ideal", None, "critical is given, but no ideal range"),
        ("sensors/temperature/night", [1, 2], "night is [1, 2], not an object"),
        ("sensors/temperature/night", {}, "night has no 'ideal'"),
        ("sensors/temperature/ideals", [1, 2], "temperature.ideals is not known here"),
        ("sensors/temperature/species/Orchid/ideal", [3, 1], "Orchid.ideal is [3, 1]"),
        ("sensors/temperature/species/orchid", {"ideal": None}, "orchid is given more than once"),
        (
            "sensors/temperature/ideal",
            [-1e9, 1.1e9],
            "is 1100000000.0, not a number from -1000000000 to",
        ),
        ("sensors/temperature/labels", ["Kas"], 'labels is ["Kas"], not an object'),
        ("sensors/temperature/labels", {"xx": "?"}, "xx is not known here; known are de, es, nl"),
        ("sensors/temperature/labels", {"de": 7}, "labels.de is 7, not a text"),
        ("sensors/temperature/labels", {"de": "x" * (MAX_TEXT + 1)}, "not a text of at most 64"),
        ("sensors/temperature/labels", {"nl": ""}, "labels.nl is empty"),
        ("sensors", [], "sensors is [], not an object"),
        ("sensors/temperature/unit", "\ud83c", 'temperature.unit is "\\ud83c", with half a'),
        ("sensors/\ud83c", GOOD["sensors"]["temperature"], "sensors.\\ud83c is a name with half"),
        ("\ud83c", 1, "\\ud83c is not known here"),
    ],
)
def test_what_cannot_be_is_refused_by_name(path: str, value: Any, says: str) -> None:
    with pytest.raises(SensorsError, match=re.escape(says)):
        parse(text_with(path, value))


@pytest.mark.parametrize("ideal", [[-1e9, 1e9], [0, 5e-324], [-5e-324, 0], [1e9 - 1e-7, 1e9]])
def test_the_widest_and_the_narrowest_ranges_are_judged_by(ideal: list[float]) -> None:
    sensor = {**GOOD["sensors"]["temperature"], "ideal": ideal, "critical": None}
    sensors = parse(text_with("sensors/temperature", sensor))
    assert sensors.named("temperature").day.ideal == Span(*ideal)
    episodes = TagEpisodes("a", 0, sensors)
    for at, value in enumerate([-1e300, -1e300, 0.0, 1e308, 1e308, ideal[0], ideal[1], 0.0]):
        scan = PastWrite(at, 1, "a", at, 0, 0, ("temperature",), (value,))
        episodes.step([scan], lambda _: True)
    assert {alarm.worst for alarm in episodes.alarms()} == {-1e300, 1e308}


@pytest.mark.parametrize("labels", [{}, {"nl": "Warmte"}, {"de": "x" * MAX_TEXT, "es": "a"}])
def test_labels_in_other_languages_may_be_given(labels: dict[str, str]) -> None:
    assert parse(text_with("sensors/temperature/labels", labels)).named("temperature").label


def test_the_file_that_comes_with_the_bridge_speaks_all_languages() -> None:
    text = files("lupin_bridge").joinpath("sensors.json").read_text(encoding="utf-8")
    sensors = json.loads(text)["sensors"]
    silent = {name for name, told in sensors.items() if told.get("labels", {}).keys() != LANGUAGES}
    assert silent == {"co2"}  # a formula


def test_an_error_names_the_line_of_the_value() -> None:
    text = text_with("sensors/temperature/night/ideal", [9, 9])
    line = 1 + text[: text.rindex("9,")].count("\n")
    with pytest.raises(SensorsError) as caught:
        parse(text)
    # The value may begin on the key's own line or below it.
    assert str(caught.value).startswith(f"line {line - 1}: sensors.temperature.night.ideal")


@pytest.mark.parametrize("text", ["", "{", '{"ramp": }', "[", "\ufeff{}"])
def test_what_is_no_json_is_refused_with_its_line(text: str) -> None:
    with pytest.raises(SensorsError, match=r"^line 1: "):
        parse(text)


@pytest.mark.parametrize("number", ["NaN", "Infinity", "-Infinity"])
def test_numbers_are_those_of_json(number: str) -> None:
    with pytest.raises(SensorsError, match="is no number of JSON"):
        parse(json.dumps(GOOD).replace("265", number))


def test_a_number_of_any_length_is_refused_by_name() -> None:
    text = json.dumps(GOOD, indent=1).replace("265", "9" * 5_000)
    with pytest.raises(SensorsError, match=r"^line \d+: fallback.hue is Infinity, not a number"):
        parse(text)


@pytest.mark.parametrize("opening", ["[", '{"ramp":'])
def test_what_is_nested_without_end_is_refused(opening: str) -> None:
    with pytest.raises(SensorsError, match="nested too deeply"):
        parse(opening * 100_000)


def test_a_key_that_is_given_twice_is_refused() -> None:
    with pytest.raises(SensorsError, match="sensors is given more than once"):
        parse(json.dumps(GOOD).replace('"ramp"', '"sensors": {}, "ramp"'))


def test_there_is_a_limit_to_the_sensors() -> None:
    table = json.loads(json.dumps(GOOD))
    entry = table["sensors"]["temperature"]
    table["sensors"] = {f"s{i}": entry for i in range(MAX_SENSORS)}
    assert len(parse(json.dumps(table)).by_name) == MAX_SENSORS
    table["sensors"]["one_more"] = entry
    with pytest.raises(SensorsError, match="sensors has 65 entries, the limit is 64"):
        parse(json.dumps(table))
