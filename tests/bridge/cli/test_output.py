"""Where a command writes: standard streams that are full, closed, or read by nobody."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.journal import NOW, SECOND, kept, pin, scan
from tests.support.waiting import PATIENCE_S


@pytest.fixture
def path(tmp_path: Path) -> Path:
    made = tmp_path / "j.sqlite"
    kept(made, [pin(), *(scan(at_ns=NOW + n * SECOND, a=n / 3) for n in range(2000))])
    return made


def ended(
    words: str, path: Path, redirected: str, *, stdout: int = subprocess.PIPE
) -> tuple[int, bytes, bytes]:
    """Exit code, output and errors of the command as a shell runs it."""
    line = f'exec "$1" -m lupin_bridge.cli.command journal {words} --journal "$2" {redirected}'
    done = subprocess.run(
        ["/bin/bash", "-c", line, "bash", sys.executable, str(path)],
        check=False,
        stdout=stdout,
        stderr=subprocess.PIPE,
        timeout=PATIENCE_S,
    )
    return (
        done.returncode,
        done.stdout,
        done.stderr.removeprefix(b"structure\nscan\nlook\nplace\n"),
    )


@pytest.mark.parametrize("action", ["check", "export"])
def test_a_standard_output_that_is_full_is_named_and_a_closed_one_is_none(
    action: str, path: Path
) -> None:
    full = b"lupin-twin: cannot write to the standard output: No space left on device\n"
    assert ended(action, path, ">/dev/full") == (1, b"", full)
    # As after >/dev/null: who closes it wants to hear nothing.
    assert ended(action, path, ">&-") == (0, b"", b"")


@pytest.mark.parametrize("redirected", ["2>&-", "2>/dev/full"])
def test_without_a_standard_error_all_is_said_that_can_be(redirected: str, path: Path) -> None:
    assert ended("check", path, redirected) == (0, f"{path} is whole\n".encode(), b"")
    missing = path.with_name("missing.sqlite")
    assert ended("check", missing, redirected) == (1, b"", b"")


def test_a_name_that_is_no_text_is_told_as_it_is(path: Path) -> None:
    strange = path.with_name("j\udcff.sqlite")
    path.rename(strange)
    code, out, err = ended("check", strange, "")
    assert (code, out, err) == (0, os.fsencode(strange) + b" is whole\n", b"")
