"""Where settings come from: the command line, the environment, a file, in this order.

pydantic says what is wrong with a value. The message names the setting as its operator gave it: as
an option, a variable, or a file's line and key.
"""

from __future__ import annotations

import difflib
import logging
import re
import stat
import tomllib
from collections.abc import Iterable, Iterator, Mapping, MutableMapping
from dataclasses import fields
from pathlib import Path
from typing import Any, Final

from lupin_bridge.settings import (
    ENV_PREFIX,
    Secrets,
    SettingError,
    Settings,
    option,
    table,
    types,
    variable,
)

log = logging.getLogger(__name__)

CONFIG_VARIABLE: Final = variable("config")
# Each by a variable of its name, or in a file that a setting names.
SECRETS: Final = tuple(spec.name for spec in fields(Secrets))
_NOT_IN_THE_TABLE: Final = (CONFIG_VARIABLE, *map(variable, SECRETS))
# No name, address or path has one, and C's functions end a text, or fail, at the first.
_CONTROL: Final = re.compile(r"[\x00-\x1f\x7f]")
_BARE: Final = re.compile(r"[A-Za-z0-9_-]{1,64}")
# Nobody writes this much; a device or a disk image given by mistake is not read to its end.
MAX_FILE_BYTES: Final = 65_536

# The setting, what its operator called it, and the value.
_Given = tuple[str, str, Any]


def settings_from(
    options: Mapping[str, Any], environment: Mapping[str, str], config: str | None = None
) -> Settings:
    """The settings, each from the first place that has it.

    `options` are those that were given on the command line, as text, by their names; `config` is
    --config's.

    Raises:
        SettingError: a value that cannot be, a key that is no setting, a file that cannot be read.

    """
    path, called = (
        (config, "--config")
        if config is not None
        else (environment.get(CONFIG_VARIABLE), CONFIG_VARIABLE)
    )
    values: dict[str, Any] = {}
    given_as: dict[str, str] = {}

    def take(given: Iterable[_Given], *, is_text: bool) -> None:
        for name, called, value in given:
            values[name], given_as[name] = _checked(name, called, value, is_text=is_text), called

    take(() if path is None else _of_file(path, called), is_text=False)
    take(_of_environment(environment), is_text=True)
    take(((name, option(name), value) for name, value in options.items()), is_text=True)
    settings = Settings(**values, given_as=given_as)
    if bool(settings.tls_cert) != bool(settings.tls_key):
        given, other = ("tls_cert", "tls_key") if settings.tls_cert else ("tls_key", "tls_cert")
        raise SettingError(
            f"{settings.called(given)} is given without {option(other)}, TLS needs both"
        )
    return settings


def _checked(name: str, called: str, value: Any, *, is_text: bool) -> Any:
    from pydantic import TypeAdapter, ValidationError  # noqa: PLC0415  # `--help` has no use for it

    try:
        found = TypeAdapter(types()[name]).validate_python(
            tuple(value) if isinstance(value, list) else value, strict=not is_text
        )
    except ValidationError as error:
        why = error.errors(include_url=False)[0]["msg"]
        shown = _shown(name, value)
        raise SettingError(f"{called} is {shown}: {why[0].lower()}{why[1:]}") from None
    texts = found if isinstance(found, tuple) else (found,)
    if any(isinstance(text, str) and _CONTROL.search(text) for text in texts):
        shown = _shown(name, value)
        raise SettingError(f"{called} is {shown}: there is a control character in it")
    return found


def _shown(name: str, value: Any) -> str:
    """A value as a message repeats it; of a private one, its kind alone."""
    if any(spec.name == name and spec.metadata["is_private"] for spec in table()):
        kind = {"str": "text", "list": "a list", "dict": "a table"}.get(
            type(value).__name__, "a number or date"
        )
        return f"{kind} that may hold a password, and is not shown"
    try:
        return repr(str(value)[:128])
    except ValueError:  # Python writes no number of so many digits
        return "a number of thousands of digits"


def _of_environment(environment: Mapping[str, str]) -> Iterator[_Given]:
    for spec in table():
        called = variable(spec.name)
        if called in environment:
            text = environment[called]
            parts = [part for word in text.split(",") if (part := word.strip())]
            yield spec.name, called, parts if spec.default == () else text


def take_secrets(settings: Settings, environment: MutableMapping[str, str]) -> Secrets:
    """What the operator keeps from others, with the environment rid of it.

    The processes that the bridge starts have no use for it.

    Raises:
        SettingError: one is given twice, or its file cannot be read.

    """
    return Secrets(**{name: _take_secret(name, settings, environment) for name in SECRETS})


def _take_secret(
    name: str, settings: Settings, environment: MutableMapping[str, str]
) -> str | None:
    secret = environment.pop(variable(name), None)
    file = getattr(settings, f"{name}_file")
    if not file:
        return secret
    called = settings.called(f"{name}_file")
    if secret is not None:
        raise SettingError(f"{variable(name)} and {called} are both given, expected one of them")
    text = read_text(file, called).strip()
    mode = Path(file).stat().st_mode
    if mode & stat.S_IROTH:
        log.warning(
            "%s %s has mode %o: anyone on this machine can read the %s, make it 600",
            called,
            file,
            stat.S_IMODE(mode),
            name.rpartition("_")[2],
        )
    return text


def strange_variables(environment: Iterable[str]) -> list[str]:
    """Warnings of variables that look like settings and are none.

    They are no error: other programs, and Kubernetes, may have variables that begin like ours.
    """
    known = {*_NOT_IN_THE_TABLE, *(variable(spec.name) for spec in table())}
    return [
        f"the environment's {name} is no setting of the bridge{_meant(name, known)}"
        for name in sorted(environment)
        if name.startswith(ENV_PREFIX) and name not in known
    ]


def _of_file(path: str, called: str) -> Iterator[_Given]:
    text = read_text(path, called)
    try:
        content = tomllib.loads(text)
    # It lets through what Python says of a number of thousands of digits, and of [[[[[...
    except (ValueError, RecursionError) as error:
        raise SettingError(f"{path} is not TOML: {error}") from None
    names = [spec.name for spec in table()]
    for key, value in content.items():
        place = f"{path}{_line_of(key, text)}: {key if _BARE.fullmatch(key) else repr(key[:64])}"
        if key in SECRETS:
            raise SettingError(
                f"{place} is no setting: put the {key.rpartition('_')[2]} into a file of its own, "
                f"and name that with {key}_file"
            )
        if key not in names:
            raise SettingError(f"{place} is no setting of the bridge{_meant(key, names)}")
        yield key, place, value


def read_text(path: str, called: str) -> str:
    """A small file's text; `called` is the setting that names it.

    Raises:
        SettingError: it cannot be read, is too large, or is no text.

    """
    try:
        with Path(path).open("rb") as file:
            content = file.read(MAX_FILE_BYTES + 1)
    except OSError as error:
        raise SettingError(f"{called} {path}: {error.strerror}") from None
    if len(content) > MAX_FILE_BYTES:
        raise SettingError(f"{called} {path} has more than {MAX_FILE_BYTES} bytes, the limit")
    try:
        return content.decode()
    except UnicodeDecodeError:
        raise SettingError(f"{called} {path} is no text (UTF-8)") from None


def _line_of(key: str, text: str) -> str:
    # tomllib gives no places. Tables are no settings, so a key stands at a line's begin.
    found = re.search(rf"""^[ \t\[]*["']?{re.escape(key)}["']?[ \t]*[=.\]]""", text, re.MULTILINE)
    return "" if found is None else f" line {text.count(chr(10), 0, found.start()) + 1}"


def _meant(name: str, known: Iterable[str]) -> str:
    near = difflib.get_close_matches(name, known, n=1)
    return f" (did you mean {near[0]}?)" if near else ""
