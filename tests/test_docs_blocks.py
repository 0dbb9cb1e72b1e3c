"""The blocks of code with the mark `run` in the docs do run, against a demo."""

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import httpx
import pytest

from tests.support.docs import ROOT, Block, blocks, pages
from tests.support.domains import own_domain, ros_env
from tests.support.processes import lupin_twin, url_of
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
