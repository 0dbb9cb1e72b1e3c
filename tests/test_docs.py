"""What the README has to name: every option, parameter, topic, route, metric and command."""

from __future__ import annotations

import re
from dataclasses import fields
from pathlib import Path

import pytest

from lupin_bridge.app import create_app
from lupin_bridge.cli import ROLES
from lupin_bridge.settings import option, table
from lupin_patrol import cli as patrol_cli
from lupin_twin.estimates import ESTIMATE_SERVICE
from lupin_twin.layers import LAYERS_BELOW, PLANTERS_TOPIC, TAGS_TOPIC
from lupin_twin.parameters import TIMES_TOPIC, TwinParameters, describe
from lupin_twin.past import HISTORY_SERVICE, STATE_AT_SERVICE
from tests.support.structure import PACKAGES, ROOMS

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def rows(title: str) -> dict[str, list[str]]:
    """The tables below a heading: first cell, without its backticks, to the other cells."""
    section = README.split(f"\n## {title}\n", 1)[1].split("\n## ", 1)[0]
    lines = [line for line in section.splitlines() if line.startswith("| `")]
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    return {key: rest for first, *rest in cells for key in re.findall(r"`([^`]+)`", first)}


def test_every_parameter_is_named_with_its_default() -> None:
    documented = rows("Parameters of the twin")
    documented.pop("use_sim_time")
    assert {name: cells[0].strip("`") for name, cells in documented.items()} == {
        spec.name: str(spec.default).lower()
        if isinstance(spec.default, bool)
        else str(spec.default or "")
        for spec in fields(TwinParameters)
    }


def test_every_parameter_is_given_with_its_range() -> None:
    documented = rows("Parameters of the twin")
    documented.pop("use_sim_time")
    for name, cells in documented.items():
        assert cells[1] == describe(name).range, name


def test_every_setting_is_named_with_its_default() -> None:
    documented = {name: cells[0] for name, cells in rows("Settings of the bridge").items()}
    for name in ("LUPIN_TOKEN", "LUPIN_MQTT_PASSWORD", "LUPIN_WEBHOOK_SECRET", "--config"):
        assert documented.pop(name) == ""
    expected = {
        option(spec.name): "" if spec.default in ((), "") else str(spec.default) for spec in table()
    }
    assert documented == expected


def test_every_route_is_named_and_none_that_is_not_there() -> None:
    documented = set(rows("Ask it over HTTP and WebSocket"))
    served = {
        "/",
        "/ws/state",
        "/rosbridge",
        "/foxglove",
        "/signin",
        "/api/signin",
        "/api/signout",
        "/docs",
        "/openapi.json",
    }
    served |= set(create_app(None).openapi()["paths"])
    assert documented == served


def test_every_topic_is_named_with_its_qos() -> None:
    documented = rows("Ask it over ROS")
    parameters = TwinParameters()
    for topic, depth in (
        (parameters.observations_topic, 50),
        (parameters.discovered_tags_topic, 50),
        (parameters.map_topic, 1),
        (parameters.state_topic, 1),
    ):
        assert f"reliable, transient local, depth {depth}" in str(rows_by_name(f"/{topic}"))
    assert "with the same stamp" in str(rows_by_name(f"/{TIMES_TOPIC}"))
    for topic in (f"{LAYERS_BELOW}<sensor>", TAGS_TOPIC, PLANTERS_TOPIC):
        assert "depth 1: while somebody subscribes" in str(rows_by_name(f"/{topic}"))
    for service in (
        parameters.field_service_name,
        ESTIMATE_SERVICE,
        STATE_AT_SERVICE,
        HISTORY_SERVICE,
    ):
        assert "services' default" in str(rows_by_name(f"/{service}"))
    assert documented == {}  # topics stand in the second column


def rows_by_name(name: str) -> list[str]:
    return [line for line in README.splitlines() if line.startswith("|") and f"`{name}`" in line]


def test_every_role_and_patrol_option_is_named() -> None:
    for role in ROLES:
        assert f"`lupin-twin {role}`" in README
    source = Path(patrol_cli.__file__).read_text(encoding="utf-8")
    for name in set(re.findall(r'add_argument\(\s*"(--[a-z-]+)"', source)):
        assert f"`{name}" in README


def test_every_make_target_that_is_named_is_there() -> None:
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    named = set(re.findall(r"(?:`|^)make ([a-z-]+)", README, re.MULTILINE))
    assert {"run", "test", "bench", "bench-live"} <= named
    assert named <= targets


@pytest.mark.parametrize(
    "page",
    [
        "README.md",
        "CHANGELOG.md",
        "CONTRIBUTING.md",
        "SECURITY.md",
        "docs/compatibility.md",
        "backend/README.md",
        "ros_node/README.md",
        "tests/README.md",
    ],
)
def test_every_file_that_a_page_names_is_there(page: str) -> None:
    text = (ROOT / page).read_text(encoding="utf-8")
    links = re.findall(r"\]\(([^)#:]+)\)", text)
    paths = re.findall(r"`((?:backend|frontend|ros_node|tests)/[^`]*)`", text)
    for name in [*links, *paths]:
        base = ROOT if name in paths else (ROOT / page).parent
        assert (base / name).exists(), name


def test_the_bridges_page_names_every_room_and_no_file_that_is_not_there() -> None:
    text = (ROOT / "backend" / "README.md").read_text(encoding="utf-8")
    bridge = PACKAGES["lupin_bridge"]
    named = {name for cell in re.findall(r"`([^`]+)`", text) for name in cell.split()}
    files = {name for name in named if re.fullmatch(r"[a-z_]+/[a-z_]+\.py", name)}
    assert len(files) > 10
    assert [name for name in sorted(files) if not (bridge / name).is_file()] == []
    rooms = {f"{room}/" if (bridge / room).is_dir() else f"{room}.py" for room in ROOMS}
    assert rooms - named == set()


def test_the_ros_packages_page_names_every_module_of_the_twin_and_none_that_is_not_there() -> None:
    text = (ROOT / "ros_node" / "README.md").read_text(encoding="utf-8")
    modules = {file.name for file in PACKAGES["lupin_twin"].glob("*.py")} - {"__init__.py"}
    assert set(re.findall(r"(?<=`)\w+\.py(?=`)", text)) - {"oracle_idw.py"} == modules


def test_the_tests_page_names_every_folder_and_no_file_that_is_not_there() -> None:
    text = (ROOT / "tests" / "README.md").read_text(encoding="utf-8")
    named = set(re.findall(r"`([\w/*]+(?:\.py|/))`", text))
    folders = {f"{path.parent.name}/" for path in (ROOT / "tests").glob("*/__init__.py")}
    assert folders <= named
    for name in named:
        assert list((ROOT / "tests").glob(name)), name
