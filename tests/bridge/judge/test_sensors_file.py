import itertools
import json
import re
from importlib.resources import files
from typing import Any, get_args

import pytest

from lupin_bridge.judge.day import ClockDay, TagDays
from lupin_bridge.judge.episodes import TagEpisodes
from lupin_bridge.judge.judging import Criteria
from lupin_bridge.judge.quantities import Language, Ranges, Span
from lupin_bridge.judge.sensors_file import MAX_TEXT, SensorsError, parse
from tests.support.store import logged

OURS = files("lupin_bridge").joinpath("sensors.json").read_text(encoding="utf-8")
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


PLAIN = json.dumps(GOOD)


def text_with(path: str, value: Any) -> str:
    """The valid file, indented, with one value replaced."""
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


def test_the_shipped_file_is_valid_with_a_hue_for_each_sensor_and_texts_in_all_languages() -> None:
    sensors = parse(OURS)
    assert (sensors.text, sensors.max_alpha) == (OURS, 0.6)
    assert sensors.named("temperature").unit == "°C"
    assert sensors.named("light").night == Ranges(None)
    assert {"vpd", "dew_point"} <= sensors.by_name.keys()
    hues = [sensor.hue for sensor in sensors.by_name.values()]
    # 20 degrees apart, around the circle: colours that people can distinguish.
    assert all(20 <= abs(a - b) <= 340 for a, b in itertools.combinations(hues, 2))
    labels = {name: it.get("labels", {}).keys() for name, it in json.loads(OURS)["sensors"].items()}
    silent = {name for name, given in labels.items() if given != set(get_args(Language))}
    assert silent == {"co2"}  # a formula


def test_every_judged_sensor_of_it_has_a_source_and_every_measured_one_a_plausible_range() -> None:
    for name, entry in json.loads(OURS)["sensors"].items():
        assert re.search(r"(19|20)\d\d", entry["source"]), name
        assert ("plausible" in entry) is not ("derived" in entry), name
    temperature, nobody = (parse(OURS).named(name) for name in ("temperature", "ph"))
    found = [temperature.is_plausible(value) for value in (-300.0, -40.0, 80.0, 80.1)]
    assert found == [False, True, True, False]
    found = [nobody.is_plausible(value) for value in (1e9, float("nan"), float("-inf"))]
    assert found == [True, False, False]


def test_the_file_says_which_sensors_are_derived() -> None:
    vpd = {"label": "", "unit": "kPa", "hue": 1, "lightness": 50, "ideal": None}
    with pytest.raises(SensorsError, match=r"sensors\.vpd\.derived is \[\], and must be \['temp"):
        parse(text_with("sensors/vpd", vpd))
    assert (
        parse(text_with("sensors/vpd", vpd | {"derived": ["temperature", "humidity"]}))
        .named("vpd")
        .unit
        == "kPa"
    )
    with pytest.raises(
        SensorsError,
        match=r"derived is \['light'\], and must be \[\]: computed here are co2_dose, ",
    ):
        parse(text_with("sensors/temperature/derived", ["light"]))
    with pytest.raises(SensorsError, match=r"derived: Input should be a valid array, not True"):
        parse(text_with("sensors/vpd", vpd | {"derived": True}))


def test_day_night_and_species_have_their_own_ranges_and_an_undeclared_sensor_none() -> None:
    temperature = parse(PLAIN).named("temperature")
    by_day = temperature.ranges(is_day=True)
    assert (by_day.ideal, by_day.critical) == (Span(18, 26), Span(10, 35))
    assert temperature.ranges(is_day=False) == Ranges(Span(15, 24))
    assert temperature.ranges(is_day=True, species="rose") == temperature.ranges(is_day=True)
    assert temperature.ranges(is_day=True, species="orchid").ideal == Span(20, 28)
    assert temperature.ranges(is_day=False, species="ORCHID") == Ranges(None)
    without_night = parse(text_with("sensors/temperature/night", ...)).named("temperature")
    assert without_night.ranges(is_day=False) == without_night
    ph = parse(PLAIN).named("ph")
    assert (ph.name, ph.label, ph.unit, ph.hue) == ("ph", "ph", "", 265)
    assert (ph.ideal, ph.critical, ph.ideals) == (None, None, ())


@pytest.mark.parametrize(
    ("path", "value", "says"),
    [
        ("ramp", ..., "ramp: Field required"),
        ("ramp/max_alpha", 1.1, "ramp.max_alpha: Input should be less than or equal to 1, not 1.1"),
        ("sensors/temperature/hue", 361, "hue: Input should be less than or equal to 360"),
        ("sensors/temperature/hue", True, "hue: Input should be a valid number, not True"),
        ("sensors/temperature/label", ..., "temperature.label: Field required"),
        ("sensors/temperature/label", "x" * (MAX_TEXT + 1), "should have at most 64 characters"),
        ("sensors/temperature/unit", 5, "unit: Input should be a valid string, not 5"),
        ("sensors/temperature/ideal", [18, 18], "ideal is [18.0, 18.0], and low must be less than"),
        ("sensors/temperature/ideal", [18], "temperature.ideal.1: Field required"),
        # The page reads the same file, and takes each of these for a list of numbers.
        ("sensors/temperature/ideal", ["18", "26"], "ideal.0: Input should be a valid number"),
        ("sensors/temperature/ideal", [18, True], "ideal.1: Input should be a valid number, not T"),
        ("sensors/temperature/ideal", {"low": 1, "high": 2}, "ideal: Input should be a valid arra"),
        ("sensors/temperature/critical", [19, 35], "is [19.0, 35.0], inside ideal [18.0, 26.0]"),
        ("sensors/temperature/ideal", None, "critical is given, but no ideal range"),
        ("sensors/temperature/night", [1, 2], "night: Input should be an object, not [1, 2]"),
        ("sensors/temperature/night", {}, "night.ideal: Field required"),
        ("sensors/temperature/ideals", [1, 2], "ideals: Unexpected keyword argument"),
        ("sensors/temperature/species/Orchid/ideal", [3, 1], "Orchid: ideal is [3.0, 1.0]"),
        ("sensors/temperature/species/orchid", {"ideal": None}, "species is given more than once"),
        ("sensors/temperature/ideal", [-1e9, 1.1e9], "less than or equal to 1000000000, not 11000"),
        ("sensors/temperature/labels", ["Kas"], "labels: Input should be an object, not ['Kas']"),
        ("sensors/temperature/labels", {"xx": "?"}, "Input should be 'de', 'es' or 'nl'"),
        ("sensors/temperature/labels", {"nl": ""}, "labels.nl: String should have at least 1 char"),
        ("sensors", [], "sensors: Input should be an object, not []"),
        ("sensors/temperature/plausible", [80, -40], "low must be less than high"),
        ("sensors/temperature/source", 5, "source: Input should be a valid string"),
        ("areas", {"North bay": "1"}, "areas.North bay"),
        ("sensors/temperature/unit", "\ud83c", "unexpected end of hex escape at line"),
        ("sensors/\ud83c", GOOD["sensors"]["temperature"], "end of hex escape at line"),
    ],
)
def test_an_impossible_value_is_refused_by_name(path: str, value: Any, says: str) -> None:
    with pytest.raises(SensorsError, match=re.escape(says)):
        parse(text_with(path, value))


@pytest.mark.parametrize("ideal", [[-1e9, 1e9], [0, 5e-324], [-5e-324, 0], [1e9 - 1e-7, 1e9]])
def test_the_widest_and_the_narrowest_ranges_are_accepted(ideal: list[float]) -> None:
    sensor = {**GOOD["sensors"]["temperature"], "ideal": ideal, "critical": None}
    sensors = parse(text_with("sensors/temperature", sensor))
    assert sensors.named("temperature").ideal == Span(*ideal)
    by = Criteria(sensors, None, ClockDay(None))
    episodes = TagEpisodes("a", 0, by, TagDays(sensors, lambda _: True, int))
    for at, value in enumerate([-1e300, -1e300, 0.0, 1e308, 1e308, ideal[0], ideal[1], 0.0]):
        scan = logged(at, 1, "a", at, 0, 0, ("temperature",), (value,))
        episodes.step([scan], lambda _: True)
    assert {alarm.worst for alarm in episodes.alarms()} == {-1e300, 1e308}


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", r"Invalid JSON: .* at line 1 column"),
        ("\ufeff{}", r"Invalid JSON: .* at line 1 column"),
        (PLAIN.replace("265", "NaN"), r"fallback\.hue: Input should be a finite number"),
        (
            json.dumps(GOOD).replace("265", "9" * 5_000),
            r"Invalid JSON: number out of range at line",
        ),
        ('{"ramp":' * 100_000, "recursion limit exceeded"),
    ],
    ids=["nothing", "a mark", "no number", "a long number", "nested"],
)
def test_text_that_is_no_json_is_refused_with_its_line(text: str, says: str) -> None:
    with pytest.raises(SensorsError, match=says):
        parse(text)


def test_areas_are_lists_of_tags_and_a_mistake_is_one_line_whatever_a_name_has() -> None:
    assert parse(text_with("areas", {"North bay": ["1", "A*"]})).by_name
    assert parse(text_with("sensors/temperature/labels", {"de": "x" * MAX_TEXT})).by_name
    with pytest.raises(SensorsError) as refused:
        parse(text_with("sensors/a\n\x1b[2Jb", {}))
    assert str(refused.value) == "sensors.a\\n\\x1b[2Jb.ideal: Field required"
