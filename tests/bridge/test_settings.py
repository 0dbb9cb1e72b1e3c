"""Settings: one table, and their ranges."""

from typing import Any, get_args, get_origin

import pytest
from annotated_types import Interval

from lupin_bridge.settings import (
    SettingError,
    Settings,
    limits_of,
    option,
    settings_from,
    table,
    types,
    variable,
)

RANGES = {
    name: limit
    for name, hint in types().items()
    for limit in getattr(hint, "__metadata__", ())
    if isinstance(limit, Interval)
}


def test_every_default_is_a_valid_value() -> None:
    for spec in table():
        value = list(spec.default) if spec.default == () else str(spec.default)
        pair = {"tls_cert": "tls_key", "tls_key": "tls_cert"}.get(spec.name, spec.name)
        assert settings_from({spec.name: value, pair: value}, {}) == Settings()


@pytest.mark.parametrize("name", RANGES)
def test_both_ends_of_a_range_are_included_and_a_value_beyond_is_named(name: str) -> None:
    low: Any = RANGES[name].ge
    high: Any = RANGES[name].le
    for end in (low, high):
        assert getattr(settings_from({name: str(end)}, {}), name) == end
    for value, limit in ((low - 1, low), (high + 1, high), ("nan", "")):
        with pytest.raises(SettingError) as refused:
            settings_from({name: str(value)}, {})
        assert str(refused.value).startswith(f"{option(name)} is '{value}': input should be ")
        assert f"{limit:.15g}" in str(refused.value) if limit != "" else True
    assert limits_of(name) == f"from {low:.15g} to {high:.15g}"


@pytest.mark.parametrize("name", [name for name in types() if limits_of(name).count(" or ")])
def test_an_invalid_choice_is_named_with_the_valid_ones(name: str) -> None:
    choices = get_args(types()[name])
    assert get_origin(types()[name]) is not None
    for choice in choices:
        assert getattr(settings_from({name: choice}, {}), name) == choice
    with pytest.raises(SettingError, match=f"{option(name)} is 'loud': input should be") as refused:
        settings_from({name: "loud"}, {})
    assert all(choice in str(refused.value) for choice in choices)


def test_tls_needs_both_files() -> None:
    assert settings_from({"tls_cert": "c.pem", "tls_key": "k.pem"}, {}).tls_key == "k.pem"
    with pytest.raises(SettingError, match="--tls-cert is given without --tls-key"):
        settings_from({"tls_cert": "c.pem"}, {})
    with pytest.raises(SettingError, match=r"^LUPIN_TLS_KEY is given without --tls-cert"):
        settings_from({}, {"LUPIN_TLS_KEY": "k.pem"})


def test_every_setting_has_a_help_text_and_an_option_of_its_name() -> None:
    assert Settings().host == "127.0.0.1", "this machine alone"
    assert all(spec.metadata["help"] and spec.metadata["group"] for spec in table())
    assert option("mqtt_url") == "--mqtt-url"
    assert variable("mqtt_url") == "LUPIN_MQTT_URL"
