"""Imports go one way. The arrows that are allowed stand here; any other one fails by its name."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections.abc import Iterable

import pytest

from tests.support.imports import (
    MODULES,
    Arrow,
    all_arrows,
    arrows_in,
    project_module,
    room,
    to_ours,
)
from tests.support.purity import CLAIMS_PURITY, PURE_EXCEPT, PURE_LIBRARIES, PURE_STANDARD
from tests.support.structure import (
    ARROWS,
    KNOW_ROS,
    KNOW_THE_DISK,
    LIBRARIES,
    PACKAGES,
    ROOMS,
    ROS,
    SHARED_WITH_PATROL,
)


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
        for target, arrow in to_ours()[f"{package}.{name}"].items()
        if target.partition(".")[0] == package
        and target.partition(".")[2] not in ARROWS[package][name]
    )


def test_a_room_looks_only_into_those_below_it() -> None:
    names = [name for name in MODULES if name.startswith("lupin_bridge.")]
    assert {room(name) for name in names} == set(ROOMS), "a new room has to say what it may import"
    assert not offenders(
        arrow
        for name in names
        for target, arrow in to_ours()[name].items()
        if target.startswith("lupin_bridge.")
        and room(target) != room(name)
        and room(target) not in ROOMS[room(name)]
    )


def test_the_rooms_lie_one_below_the_other() -> None:
    seen: set[str] = set()
    while ready := [name for name in ROOMS if name not in seen and ROOMS[name] <= seen]:
        seen.update(ready)
    assert set(ROOMS) - seen == set(), "rooms that lead in a circle"


@pytest.mark.parametrize("package", PACKAGES)
def test_no_arrow_leads_back_to_where_it_came_from(package: str) -> None:
    done: set[str] = set()

    def cycle(path: list[str]) -> list[str]:
        if path[-1] in path[:-1]:
            return path[path.index(path[-1]) :]
        if path[-1] in done:
            return []
        for target in to_ours()[path[-1]]:
            if found := cycle([*path, target]):
                return found
        done.add(path[-1])
        return []

    for name in MODULES:
        if name.startswith(f"{package}."):
            assert not " -> ".join(cycle([name]))


def test_the_twin_knows_neither_the_patrol_nor_the_bridge_and_the_patrol_its_habits_alone() -> None:
    assert not offenders(
        arrow
        for arrow in all_arrows()
        if arrow.top in PACKAGES
        and arrow.top != arrow.package
        and (arrow.package, arrow.top) != ("lupin_bridge", "lupin_twin")
        and not (
            arrow.package == "lupin_patrol" and project_module(arrow.target) in SHARED_WITH_PATROL
        )
    )


# --- ROS ----------------------------------------------------------------------------------------


def test_ros_is_imported_where_it_is_known_and_nowhere_else() -> None:
    assert not offenders(
        arrow
        for arrow in all_arrows()
        if arrow.top in ROS and arrow.module not in KNOW_ROS[arrow.package]
    )


def test_routes_and_the_application_never_lead_to_ros() -> None:
    """Not by any way round either: they have to work over any source."""
    leads_to_ros = {f"{package}.{name}" for package in KNOW_ROS for name in KNOW_ROS[package]}
    seen: set[str] = set()  # ways beyond those are known: there are none

    def way(path: list[str]) -> list[str]:
        if path[-1] in leads_to_ros:
            return path
        seen.add(path[-1])
        for target in to_ours()[path[-1]]:
            if target not in seen and (found := way([*path, target])):
                return found
        return []

    starts = [name for name in MODULES if re.match(r"lupin_bridge\.(routes\.|app$|openapi$)", name)]
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

    assert not offenders(arrow for arrow in all_arrows() if not is_allowed(arrow))


def test_one_module_crosses_between_the_ros_thread_and_the_loop() -> None:
    crossing = {"call_soon_threadsafe", "run_coroutine_threadsafe", "Thread", "start_new_thread"}
    found = [
        f"{name} uses {word} (line {node.lineno})"
        for name, text in MODULES.items()
        # A player is a process of its own, without a loop.
        if name.startswith("lupin_bridge.")
        and not name.startswith(("lupin_bridge.twin.ros_thread", "lupin_bridge.bags."))
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Attribute | ast.Name)
        and (word := node.attr if isinstance(node, ast.Attribute) else node.id) in crossing
    ]
    assert not offenders(found)


def pure_modules() -> set[str]:
    """Those that say so of themselves, and all of the twin's that know neither ROS nor the disk."""
    return {
        name
        for name, text in MODULES.items()
        if CLAIMS_PURITY.search(ast.get_docstring(ast.parse(text)) or "")
        or (
            name.startswith("lupin_twin.")
            and name.partition(".")[2] not in KNOW_ROS["lupin_twin"]
            and name not in KNOW_THE_DISK
        )
    }


def is_pure(arrow: Arrow, pure: set[str]) -> bool:
    """Whether a pure module may have this arrow."""
    if arrow.top in PACKAGES and project_module(arrow.target) in pure:
        return True
    allowed = PURE_STANDARD | PURE_LIBRARIES | PURE_EXCEPT.get(arrow.source, set())
    return any(arrow.target == name or arrow.target.startswith(f"{name}.") for name in allowed)


def test_what_is_pure_uses_only_what_is_on_the_list() -> None:
    pure = pure_modules()
    some = {"lupin_twin.throttle", "lupin_bridge.stream.hub", "lupin_bridge.stream.state_json"}
    assert some <= pure
    assert not offenders(
        arrow for arrow in all_arrows() if arrow.source in pure and not is_pure(arrow, pure)
    )


def test_the_list_for_pure_modules_leaves_the_world_out() -> None:
    pure = pure_modules()
    for target in (
        "sqlite3",
        "os",
        "time",
        "threading",
        "pathlib.Path",
        "rclpy.node.Node",
        "uvicorn",
    ):
        assert not is_pure(Arrow("lupin_twin.state", target, 1), pure), target
    assert is_pure(Arrow("lupin_twin.state", "collections.abc.Iterable", 1), pure)
    assert not is_pure(Arrow("lupin_twin.state", "lupin_twin.node.TwinNode", 1), pure)


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
