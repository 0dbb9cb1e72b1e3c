"""What the launch file takes, and what it makes of that: its arguments, and the parameters. Pure.

It stands here so that it can be tested without `launch`, which PyPI does not have.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final


class LaunchError(ValueError):
    """An argument that starts no twin; the message names it, its value and what was expected."""


@dataclass(frozen=True, slots=True)
class Argument:
    """A launch argument; empty means: not given. `choices` None: any text."""

    name: str
    description: str
    default: str = ""
    choices: tuple[str, ...] | None = None


ARGUMENTS: Final = (
    Argument("namespace", "moves the node, its topics and its services, such as gh1"),
    Argument("params_file", "file of parameters, YAML; not given: the package's config/twin.yaml"),
    Argument(
        "use_sim_time",
        "true follows /clock; not given: what the file says",
        choices=("", "true", "false"),
    ),
    Argument(
        "journal",
        "file that keeps what was observed, or off for none; not given: what the file says",
    ),
    Argument(
        "layers",
        "sensors whose fields are published for RViz, separated by commas, such as "
        "temperature,humidity; not given: what the file says",
    ),
    Argument(
        "log_level",
        "debug, info, warn, error or fatal; or of one logger, such as rcl:=debug",
        default="info",
    ),
)


def overrides(given: Mapping[str, str]) -> dict[str, bool | str | list[str]]:
    """The parameters that arguments set: only what was given, for they override the file."""
    values: dict[str, bool | str | list[str]] = {}
    if given["use_sim_time"]:
        values["use_sim_time"] = given["use_sim_time"] == "true"
    if given["journal"]:
        values["journal"] = given["journal"]
    if given["layers"]:
        values["layers"] = [name for part in given["layers"].split(",") if (name := part.strip())]
    return values


def params_file(given: Mapping[str, str], default: str, is_file: Callable[[str], bool]) -> str:
    """The file of parameters; `default` is the package's own.

    Raises:
        LaunchError: there is no such file; launch alone would only warn, and start with defaults.

    """
    path = given["params_file"] or default
    if not is_file(path):
        raise LaunchError(f"params_file is {path!r}, expected a file that is there")
    return path
