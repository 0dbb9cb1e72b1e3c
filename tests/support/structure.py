"""The table of who may import what, and the imports as they are, read off the modules' text."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
PACKAGES = {
    "lupin_twin": ROOT / "ros_node" / "lupin_twin" / "lupin_twin",
    "lupin_patrol": ROOT / "ros_node" / "lupin_patrol" / "lupin_patrol",
    "lupin_bridge": ROOT / "backend" / "lupin_bridge",
}

ROS = frozenset(
    {
        "rclpy",
        "lupin_msgs",
        "builtin_interfaces",
        "geometry_msgs",
        "nav_msgs",
        "diagnostic_msgs",
        "rcl_interfaces",
        "rosgraph_msgs",
        "std_msgs",
    }
)
# The modules that know ROS; all others have to run, and be tested, without it.
KNOW_ROS = {
    "lupin_twin": {
        "cli",
        "convert",
        "diagnostic_messages",
        "habits",
        "node",
        "ros_parameters",
        "shapes",
        "spinning",
    },
    "lupin_patrol": {"cli", "messages", "node"},
    "lupin_bridge": {"twin.ros_logs", "twin.ros_thread", "twin.web_node"},
}
# What the patrol may use of the twin: how a node behaves, and nothing of what a twin knows.
SHARED_WITH_PATROL = {"lupin_twin.habits", "lupin_twin.spinning", "lupin_twin.stop_signals"}
# Those of the twin that know the disk, threads and clocks, and still no ROS.
KNOW_THE_DISK = {
    f"lupin_twin.journal.{module}"
    for module in (
        "appending",
        "file",
        "lock",
        "pending",
        "reading",
        "restoring",
        "retention",
        "rollups",
        "salvage",
        "schema",
        "syncing",
        "writer",
    )
} | {"lupin_twin.memory"}
# What else a package may use, and in which modules: None is all of them. The bridge may use what
# its own dependencies list.
LIBRARIES: Mapping[str, Mapping[str, set[str] | None]] = {
    "lupin_twin": {
        "numpy": {"grid", "idw", "explored", "field_quality", "fields", "convert"},
    },
    "lupin_patrol": {
        "numpy": {"exploration", "geometry", "perception", "route"},
        "greenhouse_sim": {"climate", "cli"},
        "lupin_twin": {"cli", "node"},
    },
    "lupin_bridge": dict.fromkeys(
        (
            "PIL",
            "cbor2",
            "fastapi",
            "h11",
            "lupin_twin",
            "numpy",
            "orjson",
            "prometheus_client",
            "pydantic",
            "starlette",
            "uvicorn",
            "websockets",
        )
    ),
}

# module: the modules of its own package that it may import.
ARROWS: Mapping[str, Mapping[str, set[str]]] = {
    "lupin_twin": {
        "state": set(),
        "drops": set(),
        "grid": set(),
        "stop_signals": set(),
        "idw": {"grid"},
        "parameters": set(),
        "throttle": set(),
        "twin_count": set(),
        "spinning": set(),
        "workers": set(),
        "cdr": set(),
        "gaps": set(),
        "counts": {"drops"},
        "clock_watch": {"state"},
        "diagnostics": {"counts", "drops", "journal.condition", "state"},
        "diagnostic_messages": {"convert", "diagnostics"},
        "leaving": set(),
        "deferred": set(),
        "field_desk": {"field_cache", "fields", "grid", "workers"},
        "shapes": {"cdr", "state"},
        "explored": {"grid"},
        "field_cache": {"grid"},
        "field_quality": {"state", "grid", "idw"},
        "fields": {"state", "grid", "idw", "explored", "field_cache"},
        "history": {"state"},
        "lateness": set(),
        "ingest": {"drops", "history", "state"},
        "convert": {"state", "grid", "explored", "fields", "history", "ingest"},
        "journal": set(),
        "journal.rows": {"state"},
        "journal.packing": {"state"},
        "journal.condition": set(),
        "journal.runs": set(),
        "journal.pending": {"journal.rows"},
        "journal.lock": set(),
        "journal.schema": set(),
        "journal.syncing": {"journal.schema"},
        "journal.appending": {"journal.packing", "journal.rows", "journal.runs"},
        "journal.reading": {"journal.packing", "journal.rows", "journal.runs", "state"},
        "journal.restoring": {"journal.packing", "journal.reading", "journal.rows", "journal.runs"},
        "journal.rollups": {"journal.packing", "journal.reading"},
        "journal.retention": {"journal.rollups"},
        "journal.salvage": {
            "journal.packing",
            "journal.reading",
            "journal.rollups",
            "journal.schema",
        },
        "journal.file": {
            "journal.appending",
            "journal.reading",
            "journal.restoring",
            "journal.retention",
            "journal.rollups",
            "journal.rows",
            "journal.runs",
            "journal.salvage",
            "journal.schema",
            "journal.syncing",
        },
        "journal.writer": {
            "journal.condition",
            "journal.file",
            "journal.lock",
            "journal.pending",
            "journal.restoring",
            "journal.retention",
            "journal.rows",
            "journal.runs",
            "journal.schema",
        },
        "ros_parameters": {"parameters"},
        "habits": {"cdr", "counts", "drops", "gaps", "lateness", "ros_parameters", "throttle"},
        "memory": {
            "drops",
            "history",
            "ingest",
            "state",
            "journal.condition",
            "journal.restoring",
            "journal.retention",
            "journal.rows",
            "journal.runs",
            "journal.writer",
        },
        "node": {
            "clock_watch",
            "journal.runs",
            "memory",
            "convert",
            "deferred",
            "diagnostic_messages",
            "diagnostics",
            "explored",
            "drops",
            "field_cache",
            "field_desk",
            "fields",
            "grid",
            "habits",
            "history",
            "lateness",
            "ingest",
            "parameters",
            "ros_parameters",
            "shapes",
            "state",
            "twin_count",
            "workers",
        },
        "cli": {"leaving", "node", "parameters", "spinning", "stop_signals"},
    },
    "lupin_patrol": {
        "chance": set(),
        "geometry": set(),
        "climate": {"geometry"},
        "house": {"geometry"},
        "exploration": {"geometry", "house"},
        "route": {"geometry", "house"},
        "plants": {"chance", "geometry", "house"},
        "perception": {"chance", "geometry", "house", "plants"},
        "events": {"exploration", "geometry", "perception", "plants"},
        "mission": {
            "chance",
            "climate",
            "events",
            "exploration",
            "geometry",
            "house",
            "perception",
            "plants",
            "route",
        },
        "messages": {"events", "house", "perception", "plants"},
        "node": {"events", "messages"},
        "cli": {"mission", "node"},
        "__main__": {"cli"},
    },
}

# The bridge's rooms: its folders, and the modules at its top, each a room of its own. What a room
# may look into; within a folder, modules only have to go round in no circle.
ROOMS: Mapping[str, set[str]] = {
    "logs": set(),
    "metrics": set(),
    "supervisor": set(),
    "settings": {"logs"},
    "configuration": {"settings"},
    "serving": {"settings"},
    "twin": set(),
    "field": {"serving"},
    "stream": {"field"},
    "access": {"serving", "settings"},
    "rosbridge": {"field", "serving", "stream", "twin"},
    "bridge": {"field", "metrics", "serving", "settings", "stream", "twin"},
    "routes": {
        "access",
        "bridge",
        "field",
        "metrics",
        "rosbridge",
        "serving",
        "settings",
        "stream",
        "twin",
    },
    "app": {"access", "bridge", "routes", "serving", "stream"},
    "roles": {"access", "app", "bridge", "routes", "serving", "settings", "supervisor", "twin"},
    "cli": {"configuration", "logs", "roles", "settings"},
    "openapi": {"app"},
}

# What a pure module may use of the standard library. Whatever is not named here (files, sockets,
# threads, clocks, databases) is the outside world.
PURE_STANDARD = frozenset(
    {
        "__future__",
        "array",
        "collections",
        "colorsys",
        "contextlib",
        "dataclasses",
        "enum",
        "fractions",
        "functools",
        "hashlib",
        "heapq",
        "hmac",
        "html",
        "io",
        "ipaddress",
        "itertools",
        "json",
        "math",
        "re",
        "string",
        "struct",
        "types",
        "typing",
        "urllib.parse",
        "zlib",
    }
)
# And of libraries: what computes, and nothing that serves.
PURE_LIBRARIES = frozenset({"PIL", "cbor2", "numpy", "orjson", "pydantic", "websockets.frames"})
# A pure module that needs one thing more.
PURE_EXCEPT: Mapping[str, set[str]] = {
    "lupin_twin.idw": {"sys"},  # float_info
    # It has no ROS and does no input or output, but it is threads and order in time.
    "lupin_twin.workers": {"concurrent.futures", "threading", "time"},
    "lupin_twin.field_desk": {
        "concurrent.futures",
        "queue",
        "time",
    },  # where the workers' results come back
    "lupin_twin.leaving": {"logging", "os", "sys", "threading", "time"},  # the end of a process
    "lupin_twin.stop_signals": {"signal"},  # which is what it is about
    # Values and errors of modules that do more than that.
    "lupin_bridge.access.credentials": {"lupin_bridge.settings.SettingError"},
    "lupin_bridge.field.formats": {
        "lupin_bridge.field.sensors.max_alpha",
        "lupin_bridge.field.sensors.sensor",
    },
    "lupin_bridge.rosbridge.services": {"lupin_bridge.twin.source.TwinNames"},
    "lupin_bridge.rosbridge.session": {"lupin_bridge.twin.source.TwinNames"},
}
CLAIMS_PURITY = re.compile(r"\bPure\b|No input or output")


class Arrow(NamedTuple):
    """One import: the module (`package.module`), what it imports, and in which line."""

    source: str
    target: str
    line: int

    @property
    def package(self) -> str:
        return self.source.partition(".")[0]

    @property
    def module(self) -> str:
        return self.source.partition(".")[2]

    @property
    def top(self) -> str:
        """The package that is imported from."""
        return self.target.partition(".")[0]

    def __str__(self) -> str:
        return f"{self.source} -> {self.target} (line {self.line})"


def arrows_in(source: str, text: str) -> Iterator[Arrow]:
    """Every import in a module's text, those in functions and for type checkers included."""
    package = source.rpartition(".")[0]
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield Arrow(source, alias.name, node.lineno)
        elif isinstance(node, ast.ImportFrom):
            module = node.module or ""
            if node.level:
                module = ".".join(filter(None, [package, module]))
            for alias in node.names:
                # `from package import module` and `from package.module import name` alike.
                yield Arrow(source, f"{module}.{alias.name}", node.lineno)


def modules(package: str) -> dict[str, str]:
    """The text of a package's modules, by `package.folder.module`; a folder's own is its name."""
    found = {}
    for file in sorted(PACKAGES[package].rglob("*.py")):
        parts = file.relative_to(PACKAGES[package]).with_suffix("").parts
        if parts != ("__init__",):
            name = ".".join((package, *(part for part in parts if part != "__init__")))
            found[name] = file.read_text(encoding="utf-8")
    return found


MODULES = {name: text for package in PACKAGES for name, text in modules(package).items()}


def project_module(target: str) -> str | None:
    """The project's module that an import names, None where it is of no module of ours."""
    parts = target.split(".")
    names = (".".join(parts[:length]) for length in range(len(parts), 1, -1))
    return next((name for name in names if name in MODULES), None)


def room(name: str) -> str:
    """The room of the bridge that a module (`lupin_bridge.room.module`) stands in."""
    return name.split(".")[1]


ALL_ARROWS = [arrow for name, text in MODULES.items() for arrow in arrows_in(name, text)]
TO_OURS = {
    name: {
        found: arrow
        for arrow in ALL_ARROWS
        if arrow.source == name and (found := project_module(arrow.target))
    }
    for name in MODULES
}
