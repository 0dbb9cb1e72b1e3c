"""What the docs show runs: their blocks, service calls, robot, and queries of the log."""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import httpx
import pytest
import yaml
from lupin_msgs import srv

from lupin_twin.core.interfaces import SERVICES
from lupin_twin.journal.rebuild import upgrade
from lupin_twin.journal.schema import open_reader
from tests.support.docs import ROOT, Block, block_named, blocks, pages
from tests.support.domains import own_domain, ros_env
from tests.support.processes import OFTEN, Process, lupin_twin, twin_node, url_of
from tests.support.ros import Peer
from tests.support.waiting import PATIENCE_S, wait_for

BLOCKS = [block for page in pages() for block in blocks(page)]
RUN = [block for block in BLOCKS if "run" in block.marks]
# By language: the file for it, and the command that runs it.
PROGRAMS = {
    "bash": ("block.sh", ("bash", "-euo", "pipefail")),
    "sh": ("block.sh", ("bash", "-euo", "pipefail")),
    "python": ("block.py", (sys.executable,)),
    "js": ("block.mjs", ("node",)),
}
TIMEOUT_S = 60.0


@pytest.fixture(scope="module")
def demo() -> Iterator[tuple[int, str]]:
    """The ROS domain of a demo, and its address once it has a map, and half of a field is known."""
    with own_domain() as domain, lupin_twin(domain, "demo", "--speed", "3") as server:
        url = url_of(server)

        def is_mapped() -> bool:
            address = f"{url}/api/field/quality?sensor_type=temperature"
            quality = httpx.get(address, trust_env=False).json()
            has_map = httpx.get(f"{url}/api/map", trust_env=False).status_code == 200
            return has_map and bool(quality.get("painted_share", 0.0) > 0.5)

        wait_for(is_mapped, "a field of the demo", PATIENCE_S)
        yield domain, url


@pytest.mark.parametrize("block", RUN, ids=str)
def test_a_marked_block_runs(block: Block, demo: tuple[int, str], tmp_path: Path) -> None:
    domain, url = demo
    name, program = PROGRAMS[block.language]
    file = tmp_path / name
    text = re.sub(r"(?:127\.0\.0\.1|localhost):8000", urlsplit(url).netloc, block.text)
    file.write_text(text, encoding="utf-8")
    path = os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))
    # Otherwise curl accepts any status.
    (tmp_path / ".curlrc").write_text("fail\nsilent\nshow-error\n", encoding="utf-8")
    # Node looks for packages above the file.
    (tmp_path / "node_modules").symlink_to(ROOT / "node_modules")
    done = subprocess.run(
        [*program, name],
        cwd=tmp_path, env=ros_env(domain, PATH=path, CURL_HOME=str(tmp_path), no_proxy="*"),
        timeout=TIMEOUT_S, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout[-1000:] + done.stderr[-1000:]


def test_the_marks_are_those_that_the_page_about_docs_explains() -> None:
    for block in BLOCKS:
        for mark in block.marks - {"run"}:
            assert re.fullmatch(r"name=[a-z][a-z-]*", mark), block
        assert "run" not in block.marks or block.language in PROGRAMS, block


def test_every_named_block_has_a_test() -> None:
    names = [mark[5:] for block in BLOCKS for mark in block.marks if mark.startswith("name=")]
    assert len(names) == len(set(names))
    tests = "".join(file.read_text(encoding="utf-8") for file in (ROOT / "tests").rglob("*.py"))
    taken = set(re.findall(r"block_named\(\"([a-z-]+)\"\)", tests))
    assert set(names) == taken


TYPES = {f"/{service.name}": service.type_name for service in SERVICES}


def test_every_service_call_in_the_docs_fits_its_service() -> None:
    text = "\n".join(page.read_text(encoding="utf-8") for page in pages())
    calls = re.findall(
        r'^ *ros2 service call (/\S+) (lupin_msgs/srv/\w+) (?:\\\n +)?"(.*)"$', text, re.MULTILINE
    )
    assert calls
    for name, type_name, arguments in calls:
        assert TYPES[name] == type_name
        kind = getattr(srv, type_name.rpartition("/")[2]).Request
        # What the shell fills in is a number of seconds.
        given = yaml.safe_load(re.sub(r"\$\([^)]*\)", "5", arguments))
        assert filled(kind(), given) != kind()


def filled(message: Any, values: dict[str, Any]) -> Any:
    """The message with these fields, as `ros2 service call` fills it; rclpy checks their types."""
    for name, value in values.items():
        before = getattr(message, name)
        if isinstance(value, dict):
            filled(before, value)
        else:
            setattr(message, name, type(before)(value))
    return message


def test_the_tutorials_robot_and_camera_work(domain: int, tmp_path: Path) -> None:
    robot, camera = tmp_path / "robot.py", tmp_path / "camera.py"
    robot.write_text(block_named("robot").text, encoding="utf-8")
    camera.write_text(block_named("inspection").text, encoding="utf-8")
    env = ros_env(domain)
    with twin_node(domain, *OFTEN), Peer(domain) as peer:
        peer.wait_for_twin()
        with Process([sys.executable, str(robot)], env):
            third = peer.tag("3")
            first, second = peer.tag("1"), peer.tag("2")
        assert [reading.name for reading in first.readings] == ["temperature", "humidity"]
        for tag, place in ((first, (1.0, 0.5)), (second, (2.5, 3.0))):
            assert tag.pose.orientation.w == 1.0
            assert (tag.pose.position.x, tag.pose.position.y) == place
        assert (third.pose.orientation.w, len(third.readings)) == (0.0, 0)

        subprocess.run([sys.executable, camera], env=env, check=True, timeout=60)
        seen = peer.tag("1", lambda tag: tag.anomaly)
        assert (seen.species, seen.flower_count, seen.bug_count) == ("orchid", 7, 2)
        assert seen.pose == first.pose


PAGE = (ROOT / "docs" / "log.md").read_text(encoding="utf-8")
QUERIES = re.findall(r"```sql\n(.*?)```", PAGE, re.DOTALL)


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A day of a small greenhouse, whose tag 0 is called 12 here."""
    path = tmp_path_factory.mktemp("log") / "j.sqlite"
    shutil.copy(ROOT / "tests" / "fixtures" / "journals" / "day.sqlite", path)
    upgrade(path, lambda share: None)
    return path


def rows(path: Path, sql: str) -> list[tuple[object, ...]]:
    with closing(open_reader(path)) as connection:
        return connection.execute(sql).fetchall()


def test_the_temperature_of_a_day(path: Path) -> None:
    found = rows(path, QUERIES[0].replace("'12'", "'0'"))
    assert len(found) == 90
    assert found[0] == ("2025-11-21 00:00:00", 13.02)


def test_the_failed_attempts_of_a_week(path: Path) -> None:
    found = rows(path, QUERIES[1])
    assert len(found) == 11
    times = [str(row[0]) for row in found]
    assert times == sorted(times, reverse=True)
    assert {row[3] for row in found} >= {"no answer 5", "camera is dark"}


def test_the_mean_of_each_day(path: Path) -> None:
    found = {row[1:3]: row for row in rows(path, QUERIES[2])}
    assert len(QUERIES) == 3
    readings = [value for _, value in rows(path, QUERIES[0].replace("'12'", "'0'"))]
    day, _, _, mean, low, high = found["0", "temperature"]
    assert day == "2025-11-21"
    assert mean == pytest.approx(sum(map(float, map(str, readings))) / 90)
    assert (low, high) == (min(readings, key=float), max(readings, key=float))  # type: ignore[arg-type]


def test_every_table_and_column_is_named(path: Path) -> None:
    for (table,) in rows(path, "SELECT name FROM sqlite_schema WHERE type = 'table'"):
        [line] = [line for line in PAGE.splitlines() if line.startswith(f"| `{table}` |")]
        for (column,) in rows(path, f"SELECT name FROM pragma_table_info('{table}')"):
            assert column == "site" or f"`{column}`" in line, (table, column)
