"""The reference pages, written from the code: `make docs` does it, and nobody types them.

`python docs/generate.py` also writes the SROS 2 policy that `backend/deploy` holds.
"""

from __future__ import annotations

import argparse
import json
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any, Final
from unittest import mock
from xml.sax.saxutils import escape

from lupin_bridge import metrics
from lupin_bridge.app import FRAMES, ROUTED, create_app
from lupin_bridge.cli import command
from lupin_bridge.settings import CONFIG_VARIABLE, SECRETS, limits_of, option, table, variable
from lupin_patrol import cli as patrol_cli
from lupin_twin.core import interfaces
from lupin_twin.core.parameters import ARGUMENTS, TwinParameters, describe

ROOT: Final = Path(__file__).resolve().parents[1]
MESSAGES: Final = ROOT / "ros_node" / "lupin_msgs"
SENSORS: Final = ROOT / "backend" / "lupin_bridge" / "sensors.json"
POLICY: Final = ROOT / "backend" / "deploy" / "sros2-policy.xml"
# Characters a line of what a command prints.
_HELP_COLUMNS: Final = "96"
_METHODS: Final = ("get", "post", "put", "delete")
_PAGE: Final = ("/", "The page for the people who run the greenhouse")


def write_reference(folder: Path) -> None:
    """Write every page into the folder; one that has not changed keeps its time."""
    folder.mkdir(exist_ok=True)
    for file in folder.glob("*.md"):
        if file.stem not in PAGES:
            file.unlink()
    for name, page in PAGES.items():
        file, text = folder / f"{name}.md", page()
        if not file.is_file() or file.read_text(encoding="utf-8") != text:
            file.write_text(text, encoding="utf-8")


# --- settings, parameters, commands ---------------------------------------------------------------


def settings() -> str:
    """What the bridge takes from its command line, environment and file."""
    head = ("option", "variable", "default", "range", "meaning")
    groups: dict[str, list[tuple[str, ...]]] = {}
    for spec in table():
        groups.setdefault(spec.metadata["group"], []).append(
            (
                code(option(spec.name)),
                code(variable(spec.name)),
                value(spec.default),
                prose(limits_of(spec.name)),
                prose(spec.metadata["help"]),
            )
        )
    secrets = [
        (code(variable(name)), code(option(f"{name}_file")), prose(name.replace("_", " ")))
        for name in SECRETS
    ]
    return page(
        "Settings of the bridge",
        "Each setting is an option of `lupin-twin serve`, `web` and `demo`, an environment "
        "variable, and a key of the TOML file that `--config` or "
        f"`{CONFIG_VARIABLE}` names. The key is the option's name with `_` in place of `-`.\n\n"
        "The command line overrides the environment, the environment the file, and the file the "
        "default. An option that may be given more than once is a list in the file; its variable "
        "holds the values, separated by commas.",
        *(
            part
            for group, rows in groups.items()
            for part in (f"## {group[0].upper()}{group[1:]}", grid(head, rows))
        ),
        "## Secrets",
        "A secret is never an option, because other users can read command lines. It is in a "
        "variable, or in a file that a setting names.",
        grid(("variable", "file", "secret"), secrets),
    )


def parameters() -> str:
    """The twin's ROS parameters."""
    rows = []
    for spec in fields(TwinParameters):
        told = describe(spec.name)
        rows.append(
            (
                code(spec.name),
                value(spec.default),
                prose(told.range),
                "no" if told.fixed else "yes",
                prose(told.description),
            )
        )
    return page(
        "Parameters of the twin",
        "Set them like any ROS parameter: `lupin-twin serve --ros-args -p idw_power:=3.0`, or in a "
        "file of parameters. A value out of its range stops the twin at its start. While the twin "
        "runs, `ros2 param set` changes those that may change.\n\n"
        "Every node also has ROS's own `use_sim_time`: with `true` it follows `/clock`.",
        grid(("parameter", "default", "range", "may change", "meaning"), rows),
    )


def launch() -> str:
    """What the launch file takes."""
    rows = [
        (
            code(argument.name),
            value(argument.default),
            ", ".join(code(name) for name in argument.choices or () if name),
            prose(argument.description),
        )
        for argument in ARGUMENTS
    ]
    return page(
        "Launch arguments",
        "`ros2 launch lupin_twin twin.launch.py namespace:=gh1` starts the twin alone. An argument "
        "that is given overrides the file of parameters.",
        grid(("argument", "default", "values", "meaning"), rows),
    )


def commands() -> str:
    """What each command prints of itself."""
    with mock.patch.dict(os.environ, {"COLUMNS": _HELP_COLUMNS}):
        sections = [
            part
            for parser in (*_parsers(command.parser()), patrol_cli.parser())
            for part in (f"## {parser.prog}", block(parser.format_help()))
        ]
    return page(
        "Commands",
        "`twin_node` runs the twin alone. It has no options of its own: everything after "
        "`--ros-args` goes to ROS, as with every other command here.",
        *sections,
    )


def _parsers(parser: argparse.ArgumentParser) -> Iterator[argparse.ArgumentParser]:
    yield parser
    for action in parser._actions:  # noqa: SLF001  # argparse has no other way to its commands
        if isinstance(action, argparse._SubParsersAction):  # noqa: SLF001
            for below in action.choices.values():
                yield from _parsers(below)


# --- the web --------------------------------------------------------------------------------------


def http() -> str:
    """Every route, from the OpenAPI document and the functions that answer."""
    document = create_app(None).openapi()
    sections = []
    for path, operations in document["paths"].items():
        for method in filter(operations.__contains__, _METHODS):
            sections += _route(f"{method.upper()} {path}", operations[method])
    others = {_PAGE[0]: _PAGE[1]}
    for route in (route for module in ROUTED for route in module.router.routes):
        path, answer = route.path_format, route.endpoint
        if path not in document["paths"]:
            others.setdefault(path, (answer.__doc__ or "").partition("\n\n")[0])
    return page(
        "HTTP routes",
        prose(document["info"]["description"]),
        "A running bridge serves the same as `/openapi.json`; its `/docs` leads to this page.",
        *sections,
        "## Other routes",
        "Pages, documents and WebSockets, which OpenAPI does not describe.",
        grid(("route", "what"), [(code(path), prose(what)) for path, what in others.items()]),
    )


def _route(title: str, operation: Mapping[str, Any]) -> list[str]:
    summary = prose(operation.get("summary", ""))
    parts = [f"## `{title}`", summary if summary.endswith("?") else f"{summary}."]
    if description := operation.get("description"):
        parts.append(prose(description))
    if given := operation.get("parameters"):
        rows = [
            (
                code(one["name"]),
                one["in"],
                _type(one["schema"]) + (" (required)" if one.get("required") else ""),
                value(one["schema"].get("default", "")),
                prose(one.get("description", "")),
            )
            for one in given
        ]
        parts.append(grid(("parameter", "in", "type", "default", "meaning"), rows))
    answers = [
        (status, _bodies(answer), prose(answer["description"]))
        for status, answer in operation["responses"].items()
    ]
    return [*parts, grid(("status", "body", "meaning"), answers)]


def _bodies(answer: Mapping[str, Any]) -> str:
    bodies = []
    for media_type, content in answer.get("content", {}).items():
        built_from = content.get("schema", {})
        is_named = "$ref" in built_from
        bodies.append(code(media_type) + (f" {_type(built_from)}" if is_named else ""))
    return ", ".join(bodies)


def frames() -> str:
    """What comes over `/ws/state`."""
    schemas = create_app(None).openapi()["components"]["schemas"]
    return page(
        "WebSocket frames",
        "`/ws/state` sends JSON text. The field `type` of each frame names its kind.",
        *(part for model in FRAMES for part in _schema(model.__name__, schemas[model.__name__])),
    )


def types() -> str:
    """What routes and frames are made of."""
    schemas = create_app(None).openapi()["components"]["schemas"]
    framed = {model.__name__ for model in FRAMES}
    return page(
        "JSON types",
        "The types that [HTTP routes](http.md) and [WebSocket frames](frames.md) are made of.",
        *(
            part
            for name, schema in sorted(schemas.items())
            if name not in framed
            for part in _schema(name, schema)
        ),
    )


def _schema(name: str, schema: Mapping[str, Any]) -> list[str]:
    required = schema.get("required", ())
    rows = [
        (
            code(field),
            _type(described) + ("" if field in required else " (may be absent)"),
            prose(described.get("description", "")),
        )
        for field, described in schema.get("properties", {}).items()
    ]
    heading = f"(type-{name.lower()})=\n## {name}"
    parts = [heading, prose(" ".join(schema.get("description", "").split()))]
    return [*parts, grid(("member", "type", "meaning"), rows)] if rows else parts


def _type(schema: Mapping[str, Any]) -> str:
    if "$ref" in schema:
        name = schema["$ref"].rpartition("/")[2]
        return f"[{name}](#type-{name.lower()})"
    if "anyOf" in schema:
        return " or ".join(map(_type, schema["anyOf"]))
    if choices := schema.get("enum") or ([schema["const"]] if "const" in schema else []):
        return ", ".join(map(code, choices))
    if schema.get("type") == "array":
        return f"list of {_type(schema['items'])}"
    if isinstance(schema.get("additionalProperties"), Mapping):
        return f"object of {_type(schema['additionalProperties'])}"
    return str(schema.get("type", "any"))


# --- ROS ------------------------------------------------------------------------------------------


def topics() -> str:
    """Topics and services with their QoS."""
    return page(
        "Topics and services",
        "Names are relative to the node's namespace, except those that begin with `/`. So a "
        "namespace moves the whole twin. *Latched* is RELIABLE and TRANSIENT_LOCAL: a late "
        "subscriber still gets the last messages, as many as the depth.",
        "## The twin subscribes to",
        _topics(interfaces.SUBSCRIBED),
        "## The bridge subscribes to",
        "In `serve` and `web`, for [the robot on the map](../page/map.md#the-robot). It adopts the "
        "publisher's QoS, latched or not, and reads once a second. ROS remapping works.",
        _topics(interfaces.ROBOT),
        "## The twin publishes",
        _topics(interfaces.PUBLISHED),
        "## The twin serves",
        "Services are reliable and volatile. A service and each of its clients hold "
        f"{interfaces.SERVICE_DEPTH} messages; create a client with the same depth, or DDS "
        "silently loses answers.",
        grid(
            ("service", "type", "parameter", "what"),
            [
                (code(it.name), _interface(it.type_name), value(it.parameter), prose(it.meaning))
                for it in interfaces.SERVICES
            ],
        ),
        "## SROS 2 policy",
        "The only rights of `lupin_twin` and `lupin_web`. A bridge reads what the twin publishes, "
        "for its viewers. The file is `sros2-policy.xml` beside the systemd unit.",
        block(policy(), "xml"),
    )


def _topics(those: Iterable[interfaces.Topic]) -> str:
    return grid(
        ("topic", "type", "QoS", "parameter", "what"),
        [
            (
                code(it.name),
                _interface(it.type_name),
                f"{qos(it)}, depth {it.depth}",
                value(it.parameter),
                prose(it.meaning),
            )
            for it in those
        ],
    )


def qos(topic: interfaces.Topic) -> str:
    """A topic's QoS in words, without its depth."""
    if topic.is_latched:
        return "latched"
    return f"{'reliable' if topic.is_reliable else 'best effort'}, volatile"


def _interface(type_name: str) -> str:
    package, _, name = type_name.partition("/")
    kind, _, name = name.partition("/")
    shown = code(f"{package}/{name}")
    return f"[{shown}](#{kind}-{name.lower()})" if package == "lupin_msgs" else shown


def messages() -> str:
    """The interfaces' own files, comments and all."""
    parts = []
    for kind, title in (("msg", "message"), ("srv", "service")):
        for file in sorted((MESSAGES / kind).glob(f"*.{kind}")):
            parts.append(f"({kind}-{file.stem.lower()})=\n## {file.stem} ({title})")
            parts.append(block(file.read_text(encoding="utf-8")))
    return page(
        "Messages and services",
        "The package `lupin_msgs`. Names, types and order of these fields never change.",
        *parts,
    )


def policy() -> str:
    """The SROS 2 policy of twin and `web`, for the names by default."""
    published = [_root(topic.name) for topic in interfaces.PUBLISHED]
    subscribed = [_root(it.name) for it in (*interfaces.SUBSCRIBED, *interfaces.ROBOT)]
    services = [_root(service.name) for service in interfaces.SERVICES]
    of_ros = ["/parameter_events"]
    own = [f"~/{name}" for name in interfaces.OF_EVERY_NODE]
    hears = {"topics subscribe": [*subscribed, *published, *of_ros]}
    enclaves = {
        ("/greenhouse/twin", "lupin_twin"): {
            **hears,
            "topics publish": [*published, "/rosout", *of_ros],
            "services reply": [*services, *own],
        },
        ("/greenhouse/web", "lupin_web"): {
            **hears,
            "topics publish": ["/rosout", *of_ros],
            "services request": services,
            "services reply": own,
        },
    }
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', '<policy version="0.2.0">', "  <enclaves>"]
    for (path, node), rights in enclaves.items():
        lines += [f'    <enclave path="{path}">', "      <profiles>"]
        lines.append(f'        <profile ns="/" node="{node}">')
        for right, names in rights.items():
            of = right.partition("s ")[0]
            lines.append(f'          <{right}="ALLOW">')
            lines += [f"            <{of}>{escape(name)}</{of}>" for name in names]
            lines.append(f"          </{of}s>")
        lines += ["        </profile>", "      </profiles>", "    </enclave>"]
    return "\n".join([*lines, "  </enclaves>", "</policy>", ""])


def _root(name: str) -> str:
    return f"/{name.lstrip('/')}".replace("<sensor>", "*")


# --- metrics, sensors -----------------------------------------------------------------------------


def measures() -> str:
    """What `/metrics` has."""
    rows = [
        *(
            (
                code(f"{name}_total" if it.kind == "counter" else name),
                it.kind,
                code(it.label) if it.label else "",
                prose(it.help),
            )
            for name, it in sorted(metrics.METRICS.items(), key=lambda it: it[1].kind, reverse=True)
        ),
        *((code(name), "histogram", "", prose(text)) for name, text in metrics.HISTOGRAMS.items()),
    ]
    return page(
        "Metrics",
        "`/metrics` serves them in Prometheus' text format, with those of the process itself.",
        grid(("metric", "type", "label", "meaning"), rows),
    )


def sensors() -> str:
    """The sensors that the bridge knows by itself."""
    document = json.loads(SENSORS.read_text(encoding="utf-8"))
    return page(
        "Sensors and their ranges",
        "The sensors file that is built into the bridge. Your own file, given with `--sensors`, "
        "replaces it. Outside `ideal` a tag is stressed, outside `critical` it is critical.",
        block(json.dumps(document, indent=2, ensure_ascii=False), "json"),
    )


PAGES: Final[Mapping[str, Callable[[], str]]] = {
    "settings": settings,
    "parameters": parameters,
    "launch": launch,
    "commands": commands,
    "http": http,
    "frames": frames,
    "types": types,
    "topics": topics,
    "messages": messages,
    "metrics": measures,
    "sensors": sensors,
}


# --- Markdown -------------------------------------------------------------------------------------


def page(title: str, *parts: str) -> str:
    """A page of Markdown."""
    return "\n\n".join((f"# {title}", *(part.strip() for part in parts))) + "\n"


def grid(head: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    """A table; a column in which nothing stands is left out."""
    filled = list(rows)
    used = [column for column in range(len(head)) if any(row[column] for row in filled)]
    lines = [[head[column] for column in used], ["---"] * len(used)]
    lines += [[row[column].replace("|", "\\|") for column in used] for row in filled]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def prose(text: str) -> str:
    """Text of the code as it is to be read; what stands in backticks stays."""
    parts = " ".join(text.split()).split("`")
    parts[::2] = [re.sub(r"([\\*_<>\[\]{}$])", r"\\\1", part) for part in parts[::2]]
    return "`".join(parts)


def code(text: object) -> str:
    """Text as code."""
    return f"`{text}`"


def value(default: object) -> str:
    """A default as one would write it; empty, where there is none."""
    if isinstance(default, bool):
        return code(str(default).lower())
    return "" if default in ("", (), None) else code(default)


def block(text: str, language: str = "text") -> str:
    """A block of code."""
    return f"```{language}\n{text.rstrip()}\n```"


if __name__ == "__main__":
    write_reference(Path(__file__).parent / "reference")
    POLICY.write_text(policy(), encoding="utf-8")
