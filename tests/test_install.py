"""`pip install .` from a clone without a built page; `test_install_dist` has the page."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import httpx
import pytest

from tests.support.domains import ros_env
from tests.support.processes import Process, url_of
from tests.support.waiting import PATIENCE_S

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def clone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The files of the project in git, as in the work tree."""
    folder = tmp_path_factory.mktemp("clone")
    listed = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT, check=True, capture_output=True, text=True,
    )  # fmt: skip
    for name in filter(None, listed.stdout.split("\0")):
        if name.startswith(("backend/", "pyproject.toml", "README.md", ".gitignore")):
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name)
    # hatchling reads what git ignores.
    subprocess.run(["git", "init", "-q", folder], check=True)
    return folder


def installed(clone: Path, folder: Path) -> Path:
    """The bridge's package alone, installed into a folder; its libraries are those of the tests."""
    subprocess.run(
        [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-build-isolation",
         "--no-index", "--target", folder, clone],
        check=True, env={**os.environ, "PIP_DISABLE_PIP_VERSION_CHECK": "1"},
    )  # fmt: skip
    return folder


def started(package: Path, domain: int) -> Process:
    command = [sys.executable, "-m", "lupin_bridge.cli.command", "web", "--port", "0"]
    return Process(command, ros_env(domain, PYTHONPATH=str(package)))


def test_without_the_page_the_start_and_the_address_say_how_to_build_it(
    clone: Path, domain: int, tmp_path: Path
) -> None:
    package = installed(clone, tmp_path)
    assert not (package / "lupin_bridge" / "static").exists()
    with started(package, domain) as process:
        url = url_of(process)
        for method in ("GET", "HEAD"):
            answer = httpx.request(method, f"{url}/", trust_env=False, timeout=PATIENCE_S)
            assert answer.status_code == 503
            assert "npm ci && npm run build" in answer.text or method == "HEAD"
        assert "WARNING" in process.wait_for_output("npm ci && npm run build")
        # The rest is there, with the package's data files.
        for path in ("/healthz", "/docs", "/signin.css"):
            assert httpx.get(url + path, trust_env=False, timeout=PATIENCE_S).status_code == 200
