"""All programs that use numpy limit it to one thread before it is imported."""

import os
import subprocess
import sys

import pytest

from lupin_twin.runtime.process import limit_blas_threads


def test_an_explicit_setting_takes_precedence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("OPENBLAS_NUM_THREADS")
    limit_blas_threads()
    assert os.environ["OPENBLAS_NUM_THREADS"] == "1"
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "4")
    limit_blas_threads()
    assert os.environ["OPENBLAS_NUM_THREADS"] == "4"


@pytest.mark.parametrize(
    ("module", "arguments"),
    [
        ("lupin_bridge.cli.command", ["serve", "--port", "x"]),
        ("lupin_twin.cli", ["--ros-args", "-p"]),
    ],
)
def test_programs_set_the_limit_before_they_import_numpy(module: str, arguments: list[str]) -> None:
    code = f"""
import os, sys
from importlib import import_module
os.environ.pop("OPENBLAS_NUM_THREADS")
cli = import_module({module!r})
assert "numpy" not in sys.modules
use = cli.limit_blas_threads
def watched():
    assert "numpy" not in sys.modules
    use()
    os._exit(0 if os.environ["OPENBLAS_NUM_THREADS"] == "1" else 1)
cli.limit_blas_threads = watched
cli.main({arguments!r})
os._exit(2)
"""
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
