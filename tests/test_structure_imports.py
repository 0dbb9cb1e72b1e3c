"""Imports go one way. The arrows that are allowed stand here; any other one fails by its name."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).parents[1]
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
        "rcl_interfaces",
        "rosgraph_msgs",
        "std_msgs",
    }
)
# The modules that know ROS; all others have to run, and be tested, without it.
KNOW_ROS = {
    "lupin_twin": {"cli", "convert", "node", "ros_parameters", "spinning"},
    "lupin_patrol": {"cli", "messages", "node"},
    "lupin_bridge": {"ros_logs", "ros_thread", "web_node"},
}
# What else a package may use, and in which modules: None is all of them. The bridge may use what
# its own dependencies list.
LIBRARIES: Mapping[str, Mapping[str, set[str] | None]] = {
    "lupin_twin": {
        "numpy": {"idw", "explored", "field_quality", "fields", "convert"},
    },
    "lupin_patrol": {
        "numpy": {"exploration", "geometry", "perception", "route"},
        "greenhouse_sim": {"climate", "cli"},
    },
    "lupin_bridge": dict.fromkeys(
        (
            "PIL",
            "cbor2",
            "fastapi",
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
        "idw": set(),
        "parameters": set(),
        "throttle": set(),
        "twin_count": set(),
        "spinning": set(),
        "explored": {"idw"},
        "field_cache": {"idw"},
        "field_quality": {"state", "idw"},
        "fields": {"state", "idw", "explored", "field_cache"},
        "convert": {"state", "idw", "explored", "fields"},
        "ros_parameters": {"parameters"},
        "node": {
            "convert",
            "explored",
            "field_cache",
            "fields",
            "parameters",
            "ros_parameters",
            "state",
            "throttle",
            "twin_count",
        },
        "cli": {"node", "parameters", "spinning"},
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

# What a pure module must not touch: the outside world, and the clock.
IMPURE = ROS | {
    "asyncio",
    "fastapi",
    "http",
    "httpx",
    "multiprocessing",
    "os",
    "signal",
    "socket",
    "starlette",
    "subprocess",
    "threading",
    "time",
    "uvicorn",
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
    """The text of a package's modules, by `package.module`."""
    return {
        f"{package}.{file.stem}": file.read_text(encoding="utf-8")
        for file in sorted(PACKAGES[package].glob("*.py"))
        if file.stem != "__init__"
    }


MODULES = {name: text for package in PACKAGES for name, text in modules(package).items()}


def project_module(target: str) -> str | None:
    """The project's module that an import names, None where it is of no module of ours."""
    name = ".".join(target.split(".")[:2])
    return name if name in MODULES else None


ALL_ARROWS = [arrow for name, text in MODULES.items() for arrow in arrows_in(name, text)]
TO_OURS = {
    name: {
        found: arrow
        for arrow in ALL_ARROWS
        if arrow.source == name and (found := project_module(arrow.target))
    }
    for name in MODULES
}


def offenders(arrows: Iterable[object]) -> str:
    """Nothing, or the arrows one a line."""
    return "\n".join(map(str, arrows))


# --- the arrows -------------------------------------------------------------------------------


@pytest.mark.parametrize("package", ARROWS)
def test_a_module_imports_only_what_lies_below_it(package: str) -> None:
    found = {name.partition(".")[2] for name in MODULES if name.startswith(f"{package}.")}
    assert found == set(ARROWS[package]), "a new module has to say here what it may import"
    assert not offenders(
        arrow
        for name in found
        for target, arrow in TO_OURS[f"{package}.{name}"].items()
        if target.partition(".")[0] == package
        and target.partition(".")[2] not in ARROWS[package][name]
    )


@pytest.mark.parametrize("package", PACKAGES)
def test_no_arrow_leads_back_to_where_it_came_from(package: str) -> None:
    done: set[str] = set()

    def cycle(path: list[str]) -> list[str]:
        if path[-1] in path[:-1]:
            return path[path.index(path[-1]) :]
        if path[-1] in done:
            return []
        for target in TO_OURS[path[-1]]:
            if found := cycle([*path, target]):
                return found
        done.add(path[-1])
        return []

    for name in MODULES:
        if name.startswith(f"{package}."):
            assert not " -> ".join(cycle([name]))


def test_the_twin_and_the_patrol_know_nothing_of_each_other_nor_of_the_bridge() -> None:
    assert not offenders(
        arrow
        for arrow in ALL_ARROWS
        if arrow.top in PACKAGES
        and arrow.top != arrow.package
        and (arrow.package, arrow.top) != ("lupin_bridge", "lupin_twin")
    )


# --- ROS ----------------------------------------------------------------------------------------


def test_ros_is_imported_where_it_is_known_and_nowhere_else() -> None:
    assert not offenders(
        arrow
        for arrow in ALL_ARROWS
        if arrow.top in ROS and arrow.module not in KNOW_ROS[arrow.package]
    )


def test_routes_and_the_application_never_lead_to_ros() -> None:
    """Not by any way round either: they have to work over any source."""
    leads_to_ros = {f"{package}.{name}" for package in KNOW_ROS for name in KNOW_ROS[package]}

    def way(path: list[str]) -> list[str]:
        if path[-1] in leads_to_ros:
            return path
        for target in TO_OURS[path[-1]]:
            if target not in path and (found := way([*path, target])):
                return found
        return []

    starts = [name for name in MODULES if re.match(r"lupin_bridge\.(routes_|app$|openapi$)", name)]
    assert len(starts) > 5
    for name in starts:
        assert not " -> ".join(way([name]))


def test_the_pure_modules_load_without_ros() -> None:
    names = sorted(
        name
        for name in MODULES
        if name.startswith("lupin_twin.") and name.partition(".")[2] not in KNOW_ROS["lupin_twin"]
    )
    assert "lupin_twin.idw" in names
    script = "\n".join(
        [
            "import importlib, sys",
            f"for name in {[*names, 'lupin_bridge.app']!r}:",
            "    importlib.import_module(name)",
            f"    loaded = sorted({set(ROS)!r} & sys.modules.keys())",
            "    assert not loaded, f'{name} loads {loaded}'",
        ]
    )
    result = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, result.stderr


# --- other libraries, threads, purity -----------------------------------------------------------


def test_libraries_are_used_where_they_belong() -> None:
    def is_allowed(arrow: Arrow) -> bool:
        if arrow.top in sys.stdlib_module_names or arrow.top in ROS or arrow.top == arrow.package:
            return True
        if arrow.top not in LIBRARIES[arrow.package]:
            return False
        users = LIBRARIES[arrow.package][arrow.top]
        return users is None or arrow.module in users

    assert not offenders(arrow for arrow in ALL_ARROWS if not is_allowed(arrow))


def test_one_module_crosses_between_the_ros_thread_and_the_loop() -> None:
    crossing = {"call_soon_threadsafe", "run_coroutine_threadsafe", "Thread", "start_new_thread"}
    found = [
        f"{name} uses {word} (line {node.lineno})"
        for name, text in MODULES.items()
        if name.startswith("lupin_bridge.") and name != "lupin_bridge.ros_thread"
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Attribute | ast.Name)
        and (word := node.attr if isinstance(node, ast.Attribute) else node.id) in crossing
    ]
    assert not offenders(found)


def test_what_is_pure_touches_neither_the_world_nor_the_clock() -> None:
    pure = {
        name
        for name, text in MODULES.items()
        if CLAIMS_PURITY.search(ast.get_docstring(ast.parse(text)) or "")
        or (name.startswith("lupin_twin.") and name.partition(".")[2] not in KNOW_ROS["lupin_twin"])
    }
    assert {"lupin_twin.throttle", "lupin_bridge.hub", "lupin_bridge.state_json"} <= pure
    assert not offenders(
        arrow for arrow in ALL_ARROWS if arrow.source in pure and arrow.top in IMPURE
    )


def test_no_import_hides_from_this_file() -> None:
    hidden = [
        f"{name} (line {node.lineno})"
        for name, text in MODULES.items()
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Name | ast.Attribute)
        and (node.id if isinstance(node, ast.Name) else node.attr)
        in ("__import__", "import_module")
    ]
    assert not offenders(hidden)


def test_every_way_to_import_is_seen() -> None:
    text = (
        "import a.b, c as d\n"
        "from e.f import g as h\n"
        "from . import i\n"
        "from .j import k\n"
        "if TYPE_CHECKING:\n    import l\n"
        "def m():\n    from n import o\n"
    )
    targets = [arrow.target for arrow in arrows_in("package.module", text)]
    assert sorted(targets) == sorted(["a.b", "c", "e.f.g", "package.i", "package.j.k", "l", "n.o"])
