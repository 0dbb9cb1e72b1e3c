"""Settings: one table, with every range checked at construction."""

from __future__ import annotations

import math
from typing import Any

import pytest

from lupin_bridge.settings import SettingError, Settings, one_of, option, table, variable

NUMBERS = [spec for spec in table() if spec.metadata["low"] is not None]


def test_the_defaults_serve_this_machine_alone() -> None:
    settings = Settings()
    assert (settings.host, settings.port, settings.max_rate_hz) == ("127.0.0.1", 8000, 10.0)


@pytest.mark.parametrize("spec", NUMBERS, ids=lambda spec: str(spec.name))
def test_both_ends_of_a_range_belong_to_it(spec: Any) -> None:
    for end in (spec.metadata["low"], spec.metadata["high"]):
        assert getattr(Settings(**{spec.name: end}), spec.name) == end


@pytest.mark.parametrize("spec", NUMBERS, ids=lambda spec: str(spec.name))
def test_a_value_out_of_its_range_is_named_with_the_range(spec: Any) -> None:
    low, high = spec.metadata["low"], spec.metadata["high"]
    for value in (math.nextafter(low, -math.inf), math.nextafter(high, math.inf), math.nan):
        with pytest.raises(SettingError) as refused:
            Settings(**{spec.name: value})  # type: ignore[arg-type]
        for named in (option(spec.name), str(value), f"{low:g}", f"{high:g}"):
            assert named in str(refused.value)


def test_an_empty_host_is_refused() -> None:
    with pytest.raises(SettingError, match="--host is empty"):
        Settings(host="")


def test_tls_needs_both_files() -> None:
    assert Settings(tls_cert="c.pem", tls_key="k.pem").tls_key == "k.pem"
    with pytest.raises(SettingError, match="--tls-cert is given without --tls-key"):
        Settings(tls_cert="c.pem")
    with pytest.raises(SettingError, match="--tls-key is given without --tls-cert"):
        Settings(tls_key="k.pem")


def test_every_setting_has_a_help_text_and_an_option_of_its_name() -> None:
    assert all(spec.metadata["help"] for spec in table())
    assert option("client_timeout_s") == "--client-timeout-s"
    assert variable("client_timeout_s") == "LUPIN_CLIENT_TIMEOUT_S"


@pytest.mark.parametrize("spec", [spec for spec in table() if spec.metadata["choices"]])
def test_what_is_none_of_the_choices_is_named_with_them(spec: Any) -> None:
    choices = spec.metadata["choices"]
    for choice in choices:
        assert getattr(Settings(**{spec.name: choice}), spec.name) == choice
    with pytest.raises(SettingError) as refused:
        Settings(**{spec.name: "loud"})  # type: ignore[arg-type]
    assert str(refused.value) == f"{option(spec.name)} is 'loud', must be {one_of(choices)}"


def test_a_mistake_is_called_what_its_operator_called_it() -> None:
    with pytest.raises(SettingError, match=r"^LUPIN_TLS_KEY is given without --tls-cert"):
        Settings(tls_key="k.pem", given_as={"tls_key": "LUPIN_TLS_KEY"})


def test_choices_are_told_as_in_a_sentence() -> None:
    assert one_of(["a", "b", "c"]) == "a, b or c"
    assert one_of(["a"]) == "a"
