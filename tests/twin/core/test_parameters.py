"""Parameters: the contract's names and defaults, and a clear error for each bad value."""

import math
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import pytest
import yaml

from lupin_twin.core.parameters import ParameterError, TwinParameters, changed, describe

DEFAULTS = {
    "observations_topic": "floranova/observations",
    "discovered_tags_topic": "perception/discovered_tags",
    "map_topic": "map",
    "state_topic": "twin/state",
    "field_service_name": "twin/get_field",
    "state_publish_rate_hz": 1.0,
    "frame_id": "map",
    "max_pose_m": 1000.0,
    "buffer_len": 32,
    "idw_power": 2.0,
    "idw_falloff_radius_m": 1.5,
    "idw_max_distance_m": 1.5,
    "clip_to_explored": False,
    "max_grid_cells": 1_000_000,
    "field_cache_mb": 64.0,
    "day_length_s": 86_400.0,
    "layers": (),
    "journal": "",
    "journal_days": 90.0,
    "journal_max_mb": 4000.0,
}


def parameters(name: str, value: Any) -> TwinParameters:
    return TwinParameters(**{name: value})


def test_the_shipped_file_has_every_parameter_at_its_default() -> None:
    file = Path("ros_node/lupin_twin/config/twin.yaml")
    # For every node: a twin of another name or namespace, and `web`, read it too.
    # ROS cannot infer the type of an empty list.
    assert yaml.safe_load(file.read_text()) == {
        "/**": {"ros__parameters": {**DEFAULTS, "layers": [""], "use_sim_time": False}}
    }


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("idw_power", 0.0),
        ("idw_power", math.nan),
        ("clip_to_explored", 1),
        ("field_cache_mb", -1.0),
        ("day_length_s", 0.0),
        ("day_length_s", 86_401.0),
        ("idw_power", math.inf),
        ("idw_power", "two"),
        ("idw_max_distance_m", math.inf),
        ("buffer_len", 1.5),
        ("buffer_len", True),
        ("frame_id", ""),
        ("frame_id", 7),
        ("map_topic", ""),
        ("observations_topic", None),
        ("layers", ["co2", 7]),
        ("layers", 7),
    ],
)
def test_a_bad_value_is_refused_by_name_with_the_value(name: str, value: Any) -> None:
    with pytest.raises(ParameterError) as caught:
        parameters(name, value)
    message = str(caught.value)
    assert message.startswith(f"parameter {name} is ")
    assert "expected" in message
    assert value == "" or str(value) in message


@pytest.mark.parametrize("name", [f.name for f in fields(TwinParameters) if describe(f.name).low])
def test_both_ends_of_a_range_are_included_and_a_value_beyond_is_refused(name: str) -> None:
    low, high = describe(name).low, describe(name).high
    assert low is not None
    for end in (low, high):
        assert getattr(parameters(name, end), name) == end
    beyond: Any
    for beyond in (low - 1 if type(low) is int else low / 2, high * 2):
        with pytest.raises(ParameterError, match=name):
            parameters(name, beyond)


@pytest.mark.parametrize(
    ("given", "names"),
    [([], ()), (None, ()), ([""], ()), ("co2", ("co2",)), (["co2", "", "light"], ("co2", "light"))],
)
def test_empty_names_in_a_list_do_not_count(given: Any, names: tuple[str, ...]) -> None:
    assert parameters("layers", given).layers == names


CHANGEABLE = {
    "state_publish_rate_hz": 5,
    "idw_power": 3.0,
    "idw_falloff_radius_m": 2.0,
    "idw_max_distance_m": 2.0,
    "max_pose_m": 2000.0,
    "clip_to_explored": True,
}


def test_a_dynamic_parameter_changes_at_runtime_and_the_others_stay() -> None:
    before = TwinParameters(buffer_len=5)
    after = changed(before, CHANGEABLE)
    assert asdict(after) == asdict(before) | CHANGEABLE
    assert type(after.state_publish_rate_hz) is float


@pytest.mark.parametrize("name", sorted(set(DEFAULTS) - set(CHANGEABLE)))
def test_a_read_only_parameter_cannot_change_and_the_refusal_says_why(name: str) -> None:
    with pytest.raises(ParameterError) as caught:
        changed(TwinParameters(), {"idw_power": 3.0, name: "other"})
    text = str(caught.value)
    assert text.startswith(f"parameter {name} is ")
    assert f"cannot become 'other' while the twin runs: {describe(name).fixed}" in text
    assert len(describe(name).fixed) > 20


@pytest.mark.parametrize("wrong", [{"idw_power": "x" * 10**6}, {"layers": {"x": "y" * 10**6}}])
def test_an_error_repeats_only_the_beginning_of_a_long_value(wrong: Any) -> None:
    with pytest.raises(ParameterError) as caught:
        TwinParameters(**wrong)
    assert len(str(caught.value)) < 200
    with pytest.raises(ParameterError) as caught:
        changed(TwinParameters(), {"frame_id": "x" * 10**6})
    assert len(str(caught.value)) < 400


def test_off_without_quotes_which_yaml_reads_as_false_turns_the_journal_off() -> None:
    assert TwinParameters(journal=False).journal == "off"  # type: ignore[arg-type]
    with pytest.raises(ParameterError, match="parameter journal is True"):
        TwinParameters(journal=True)  # type: ignore[arg-type]
