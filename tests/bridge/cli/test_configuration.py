"""Settings from the command line, the environment and a file: what comes first, what is named."""

import logging
from pathlib import Path
from typing import Any, get_args

import pytest

from lupin_bridge.settings import (
    MAX_FILE_BYTES,
    Secrets,
    SettingError,
    Settings,
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
    """Writes a file of settings and returns its path."""

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


# --- what comes first -----------------------------------------------------------------------------


def test_the_command_line_comes_before_the_environment_that_before_the_file(config: Any) -> None:
    path = config("port = 1\nmax_clients = 1\nreading_validity_s = 1\n")
    environment = {"LUPIN_PORT": "2", "LUPIN_MAX_CLIENTS": "2"}
    settings = settings_from({"port": "3"}, environment, path)
    assert (settings.port, settings.max_clients, settings.reading_validity_s) == (3, 2, 1.0)
    assert settings.called("port") == "--port"
    assert settings.called("max_clients") == "LUPIN_MAX_CLIENTS"
    assert settings.called("reading_validity_s") == f"{path} line 3: reading_validity_s"


def test_a_list_is_the_first_places_alone(config: Any) -> None:
    path = config('allow_host = ["of.the.file"]\n')
    environment = {"LUPIN_ALLOW_HOST": "one.example, two.example ,"}
    assert settings_from({}, {}, path).allow_host == ("of.the.file",)
    assert settings_from({}, environment, path).allow_host == ("one.example", "two.example")
    assert settings_from({"allow_host": ["mine"]}, environment, path).allow_host == ("mine",)


@pytest.mark.parametrize("spec", table(), ids=lambda spec: str(spec.name))
def test_every_setting_goes_by_a_variable_and_by_a_line_of_a_file(spec: Any, config: Any) -> None:
    value, text, in_toml = {
        int: (7, "7", "7"),
        float: (7.5, "7.5", "7.5"),
        str: ("x", "x", "'x'"),
        tuple: (("x", "y"), "x,y", "['x', 'y']"),
    }[type(spec.default)]
    for choice in get_args(types()[spec.name]) if spec.name.startswith(("log", "http")) else ():
        value, text, in_toml = choice, choice, repr(choice)
    pair = {"tls_cert": "tls_key", "tls_key": "tls_cert"}.get(spec.name)
    options = {} if pair is None else {pair: "other"}
    for settings in (
        settings_from(options, {variable(spec.name): text}),
        settings_from(options, {}, config(f"{spec.name} = {in_toml}\n")),
    ):
        assert getattr(settings, spec.name) == value


def test_the_file_may_be_named_by_the_environment(config: Any, tmp_path: Path) -> None:
    environment = {"LUPIN_CONFIG": config("port = 1\n")}
    assert settings_from({}, environment).port == 1
    assert refusal({}, environment, str(tmp_path / "no")) == (
        f"--config {tmp_path}/no: No such file or directory"
    )
    assert refusal({}, {"LUPIN_CONFIG": "/no"}) == "LUPIN_CONFIG /no: No such file or directory"


# --- mistakes -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "value", "named"),
    [
        (
            "LUPIN_PORT",
            "65536",
            "LUPIN_PORT is '65536': input should be less than or equal to 65535",
        ),
        ("LUPIN_PORT", "tcp://10.0.0.1:80", "LUPIN_PORT is 'tcp://10.0.0.1:80': input should be a"),
        ("LUPIN_PORT", "", "LUPIN_PORT is '': input should be a valid integer"),
        ("LUPIN_READING_VALIDITY_S", "long", "LUPIN_READING_VALIDITY_S is 'long': input should be"),
        ("LUPIN_HOST", "", "LUPIN_HOST is '': string should have at least 1 char"),
        ("LUPIN_LOG_LEVEL", "loud", "LUPIN_LOG_LEVEL is 'loud': input should be 'debug', 'info', "),
        ("LUPIN_TLS_CERT", "c.pem", "LUPIN_TLS_CERT is given without --tls-key"),
    ],
)
def test_a_mistake_in_a_variable_is_named(name: str, value: str, named: str) -> None:
    assert refusal({}, {name: value}).startswith(named)


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("port = 65536", " line 1: port is '65536': input should be less than or equal to 65535"),
        (
            "\n# a comment\n  port = '8000'",
            " line 3: port is '8000': input should be a valid integer",
        ),
        ("port = true", " line 1: port is 'True': input should be a valid integer"),
        ("port = 8000.0", " line 1: port is '8000.0': input should be a valid integer"),
        ("host = 7", " line 1: host is '7': input should be a valid string"),
        ("host = ''", " line 1: host is '': string should have at least 1 char"),
        ("allow_host = 'x'", " line 1: allow_host is 'x': input should be a valid tuple"),
        ("allow_host = [1]", " line 1: allow_host is '[1]': input should be a valid string"),
        ("reading_validity_s = nan", " line 1: reading_validity_s is 'nan': input should be"),
        ("port = 1\nmax-clients = 5", " line 2: max-clients is no setting of the bridge (did you"),
        ("[bridge]\nport = 1", " line 1: bridge is no setting of the bridge"),
        ('"a\\nb" = 1', ": 'a\\nb' is no setting of the bridge"),
        ("config = 'x'", " line 1: config is no setting of the bridge"),
        ("token = 'x'", " line 1: token is no setting: put the token into a file of its own"),
        ("mqtt_password = 'x'", " line 1: mqtt_password is no setting: put the password into a f"),
        ("port = ", " is not TOML: Invalid value (at end of document)"),
        (f"port = {'9' * 5_000}", " is not TOML: Exceeds the limit (4300 digits) for integer"),
        (r'sensors = "a\u0000b"', " line 1: sensors is 'a\\x00b': there is a co"),
        (
            r'allow_host = ["a\nb"]',
            " line 1: allow_host is \"['a\\\\nb']\": there is a control char",
        ),
        ("port = 1\nport = 2\n", " is not TOML: Cannot overwrite a value (at line 2, column 9)"),
    ],
)
def test_a_mistake_in_a_file_is_named_with_its_line(config: Any, text: str, named: str) -> None:
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
    assert f"line 1: {name} is " in message
    assert "pa55" not in message


def test_what_is_no_file_of_settings_is_named(tmp_path: Path) -> None:
    assert refusal({}, {}, str(tmp_path)) == f"--config {tmp_path}: Is a directory"
    odd = tmp_path / "odd"
    odd.write_bytes(b"\xff")
    assert refusal({}, {}, str(odd)) == f"--config {odd} is no text (UTF-8)"
    odd.write_bytes(b"#" * MAX_FILE_BYTES)
    assert settings_from({}, {}, str(odd)) == Settings()
    odd.write_bytes(b"#" * (MAX_FILE_BYTES + 1))
    assert refusal({}, {}, str(odd)) == f"--config {odd} has more than 65536 bytes, the limit"
    assert refusal({}, {}, "/dev/zero").endswith("has more than 65536 bytes, the limit")


def test_a_strange_variable_is_warned_of_and_others_are_nobodys_business() -> None:
    environment = {"LUPIN_PROT": "1", "LUPIN_PORT": "1", "LUPIN_TOKEN": "", "PORT": "1"}
    (warning,) = strange_variables(environment)
    assert warning == (
        "the environment's LUPIN_PROT is no setting of the bridge (did you mean LUPIN_PORT?)"
    )


# --- the token ------------------------------------------------------------------------------------


def test_the_token_leaves_the_environment() -> None:
    environment = {"LUPIN_TOKEN": TOKEN, "HOME": "/"}
    assert take_secrets(Settings(), environment).token == TOKEN
    assert environment == {"HOME": "/"}
    assert take_secrets(Settings(), environment).token is None


def test_a_token_file_is_its_line(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    file = tmp_path / "token"
    file.write_text(f"{TOKEN}\n", encoding="ascii")
    settings = Settings(token_file=str(file))
    for mode, warned in ((0o600, False), (0o640, False), (0o644, True)):
        file.chmod(mode)
        caplog.clear()
        with caplog.at_level(logging.WARNING):
            assert take_secrets(settings, {}).token == TOKEN
        assert bool(caplog.messages) == warned
    assert "mode 644: anyone on this machine can read the token" in caplog.text


def test_two_tokens_are_one_too_many(tmp_path: Path) -> None:
    settings = Settings(token_file=str(tmp_path / "token"))
    with pytest.raises(SettingError, match="LUPIN_TOKEN and --token-file are both given"):
        take_secrets(settings, {"LUPIN_TOKEN": TOKEN})
    with pytest.raises(SettingError, match=r"--token-file .*/token: No such file"):
        take_secrets(settings, {})


@pytest.mark.parametrize("name", ["mqtt_password", "webhook_secret"])
def test_the_other_secrets_go_by_a_variable_or_a_file_too(name: str, tmp_path: Path) -> None:
    file = tmp_path / "secret"
    file.write_text("of the file\n", encoding="utf-8")
    environment = {variable(name): "of the environment"}
    assert getattr(take_secrets(Settings(), environment), name) == "of the environment"
    assert environment == {}
    settings = Settings(**{f"{name}_file": str(file)})  # type: ignore[arg-type]
    assert getattr(take_secrets(settings, {}), name) == "of the file"
    with pytest.raises(SettingError, match=f"{variable(name)} and --.*-file are both given"):
        take_secrets(settings, {variable(name): "x"})
    assert strange_variables([variable(name)]) == []
    assert "hunter2" not in repr(Secrets("hunter2", "hunter2", "hunter2"))


# --- the process ----------------------------------------------------------------------------------


def test_the_process_takes_all_three(config: Any, tmp_path: Path) -> None:
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
        assert '"level": "warning"' in live.process.wait_for_output("LUPIN_NONSENSE is no setting")
        assert "LUPIN_TOKEN_FILE" in live.process.wait_for_output("can read the token")


def test_a_mistake_anywhere_ends_the_start_with_one_line(config: Any, tmp_path: Path) -> None:
    path = config("port = 1\nprot = 2\n")
    assert refused_start("--config", path) == (
        f"lupin-twin: {path} line 2: prot is no setting of the bridge (did you mean port?)"
    )
    assert refused_start(LUPIN_MAX_CLIENTS="0") == (
        "lupin-twin: LUPIN_MAX_CLIENTS is '0': input should be greater than or equal to 1"
    )
    short = tmp_path / "token"
    short.write_text("short\n", encoding="ascii")
    short.chmod(0o600)
    assert refused_start("--token-file", str(short)).startswith(
        "lupin-twin: --token-file has 5 characters, must have at least 16"
    )
