"""Settings: one table with their ranges; command line, environment and file; error messages."""

from pathlib import Path
from typing import Any, get_args, get_origin

import pytest
from annotated_types import Interval

from lupin_bridge.settings import (
    MAX_FILE_BYTES,
    Secrets,
    SettingError,
    Settings,
    limits_of,
    option,
    settings_from,
    strange_variables,
    table,
    take_secrets,
    types,
    variable,
)
from tests.support.access import TOKEN, refused_start, served


@pytest.fixture
def config(tmp_path: Path) -> Any:
    def write(text: str) -> str:
        file = tmp_path / "bridge.toml"
        file.write_text(text, encoding="utf-8")
        return str(file)

    return write


def refusal(
    options: dict[str, Any] | None = None,
    environment: dict[str, str] | None = None,
    config: str | None = None,
) -> str:
    with pytest.raises(SettingError) as refused:
        settings_from(options or {}, environment or {}, config)
    assert "\n" not in str(refused.value)
    return str(refused.value)


def test_the_command_line_overrides_the_environment_and_that_the_file_also_for_lists(
    config: Any,
) -> None:
    path = config("port = 1\nmax_clients = 1\nreading_validity_s = 1\n")
    environment = {"LUPIN_PORT": "2", "LUPIN_MAX_CLIENTS": "2"}
    settings = settings_from({"port": "3"}, environment, path)
    assert (settings.port, settings.max_clients, settings.reading_validity_s) == (3, 2, 1.0)
    assert settings.called("port") == "--port"
    assert settings.called("max_clients") == "LUPIN_MAX_CLIENTS"
    assert settings.called("reading_validity_s") == f"{path}: reading_validity_s"
    path = config('allow_host = ["of.the.file"]\n')
    environment = {"LUPIN_ALLOW_HOST": "one.example, two.example ,"}
    assert settings_from({}, {}, path).allow_host == ("of.the.file",)
    assert settings_from({}, environment, path).allow_host == ("one.example", "two.example")
    assert settings_from({"allow_host": ["mine"]}, environment, path).allow_host == ("mine",)


def test_an_environment_variable_may_name_the_file_and_is_named(
    config: Any, tmp_path: Path
) -> None:
    environment = {"LUPIN_CONFIG": config("port = 1\n")}
    assert settings_from({}, environment).port == 1
    assert refusal({}, environment, str(tmp_path / "no")) == (
        f"--config {tmp_path}/no: No such file or directory"
    )
    assert refusal({}, {"LUPIN_CONFIG": "/no"}) == "LUPIN_CONFIG /no: No such file or directory"
    for name, says in (("PORT", "input should be a valid integer"), ("HOST", "string should have")):
        assert refusal({}, {f"LUPIN_{name}": ""}).startswith(f"LUPIN_{name} is '': {says}")


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("port = 65536", ": port is '65536': input should be less than or equal to 65535"),
        (
            "\n# a comment\n  port = true",
            ": port is 'True': input should be a valid integer",
        ),
        ("allow_host = 'x'", ": allow_host is 'x': expected a list, such as ['x']"),
        ('"a\\nb" = 1', ": 'a\\nb' is not a setting of the bridge"),
        ("token = 'x'", ": token is not a setting: put the token into a file of its own"),
        (
            "mqtt_password = 'x'",
            ": mqtt_password is not a setting: put the password into a f",
        ),
        ("port = ", " is not TOML: Invalid value (at end of document)"),
        (f"port = {'9' * 5_000}", " is not TOML: Exceeds the limit (4300 digits) for integer"),
        (r'sensors = "a\u0000b"', ": sensors is 'a\\x00b': it contains a co"),
    ],
)
def test_a_mistake_in_a_file_is_named(config: Any, text: str, named: str) -> None:
    path = config(text)
    assert refusal({}, {}, path).startswith(path + named)


@pytest.mark.parametrize("name", ["archive_url", "mqtt_url", "webhook_url"])
@pytest.mark.parametrize(
    "value",
    [
        '["postgresql://gh1:pa55word@db/x"]',
        '"postgresql://gh1:pa55word@db/\\n"',
        '{a = "pa55word"}',
    ],
)
def test_an_address_that_may_hold_a_password_is_never_repeated(
    config: Any, name: str, value: str
) -> None:
    message = refusal(config=config(f"{name} = {value}\n"))
    assert f": {name} is " in message
    assert "pa55" not in message


def test_an_invalid_settings_file_is_named(tmp_path: Path) -> None:
    assert refusal({}, {}, str(tmp_path)) == f"--config {tmp_path}: Is a directory"
    odd = tmp_path / "odd"
    odd.write_bytes(b"\xff")
    assert refusal({}, {}, str(odd)) == f"--config {odd} is not UTF-8 text"
    odd.write_bytes(b"#" * MAX_FILE_BYTES)
    assert settings_from({}, {}, str(odd)) == Settings()
    odd.write_bytes(b"#" * (MAX_FILE_BYTES + 1))
    assert refusal({}, {}, str(odd)) == f"--config {odd} has more than 65536 bytes, the limit"
    assert refusal({}, {}, "/dev/zero").endswith("has more than 65536 bytes, the limit")


def test_an_unknown_variable_of_ours_is_warned_about_and_others_are_ignored() -> None:
    environment = {"LUPIN_PROT": "1", "LUPIN_PORT": "1", "LUPIN_TOKEN": "", "PORT": "1"}
    (warning,) = strange_variables(environment)
    assert warning == "environment variable LUPIN_PROT is not a setting of the bridge"


@pytest.mark.parametrize("name", ["token", "mqtt_password", "webhook_secret"])
def test_a_secret_comes_from_a_variable_which_is_then_removed_or_from_a_file(
    name: str, tmp_path: Path
) -> None:
    environment = {variable(name): "of the environment", "HOME": "/"}
    assert getattr(take_secrets(Settings(), environment), name) == "of the environment"
    assert environment == {"HOME": "/"}
    file = tmp_path / "secret"
    settings = Settings(**{f"{name}_file": str(file)})  # type: ignore[arg-type]
    with pytest.raises(SettingError, match=r"-file .*/secret: No such file"):
        take_secrets(settings, {})
    file.write_text("of the file\n", encoding="utf-8")
    assert getattr(take_secrets(settings, {}), name) == "of the file"
    with pytest.raises(SettingError, match=f"{variable(name)} and --.*-file are both given"):
        take_secrets(settings, {variable(name): "x"})
    assert strange_variables([variable(name)]) == []
    assert "hunter2" not in repr(Secrets("hunter2", "hunter2", "hunter2"))


def test_a_world_readable_file_causes_a_warning(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    file = tmp_path / "token"
    file.write_text(f"{TOKEN}\n", encoding="ascii")
    for mode, warned in ((0o600, False), (0o640, False), (0o644, True)):
        file.chmod(mode)
        take_secrets(Settings(token_file=str(file)), {})
        assert bool(caplog.messages) == warned
    assert "mode 644: anyone on this machine can read the token" in caplog.text


def test_the_process_reads_all_three_sources(config: Any, tmp_path: Path) -> None:
    secret = tmp_path / "token"
    secret.write_text(TOKEN, encoding="ascii")
    secret.chmod(0o644)
    path = config("log_format = 'json'\nlog_level = 'warning'\n")
    with served(
        "--allow-host", "twin.example", "--config", path,
        LUPIN_TOKEN_FILE=str(secret), LUPIN_LOG_LEVEL="info", LUPIN_NONSENSE="1",
    ) as live:  # fmt: skip
        answer = live.get("/api/state", {"Host": "twin.example"})
        assert answer.status_code == 401
        bearer = {"Authorization": f"Bearer {TOKEN}", "Host": "twin.example"}
        assert live.get("/api/state", bearer).status_code == 200
        assert '"level": "warning"' in live.process.wait_for_output(
            "LUPIN_NONSENSE is not a setting"
        )
        assert "LUPIN_TOKEN_FILE" in live.process.wait_for_output("can read the token")


def test_any_mistake_ends_the_start_with_one_line(config: Any, tmp_path: Path) -> None:
    path = config("port = 1\nprot = 2\n")
    assert refused_start("--config", path) == (
        f"lupin-twin: {path}: prot is not a setting of the bridge"
    )
    short = tmp_path / "token"
    short.write_text("short\n", encoding="ascii")
    short.chmod(0o600)
    assert refused_start("--token-file", str(short)).startswith(
        "lupin-twin: --token-file has 5 characters, must have at least 16"
    )


RANGES = {
    name: limit
    for name, hint in types().items()
    for limit in getattr(hint, "__metadata__", ())
    if isinstance(limit, Interval)
}


def test_every_setting_has_a_valid_default_a_help_text_and_an_option_of_its_name() -> None:
    for spec in table():
        value = list(spec.default) if spec.default == () else str(spec.default)
        pair = {"tls_cert": "tls_key", "tls_key": "tls_cert"}.get(spec.name, spec.name)
        assert settings_from({spec.name: value, pair: value}, {}) == Settings()
        assert spec.metadata["help"]
        assert spec.metadata["group"]
    assert Settings().host == "127.0.0.1", "this machine alone"
    assert option("mqtt_url") == "--mqtt-url"
    assert variable("mqtt_url") == "LUPIN_MQTT_URL"


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
