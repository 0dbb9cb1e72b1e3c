import os
import subprocess
import sys

import pytest

from lupin_bridge.console import say, tell
from tests.support.waiting import PATIENCE_S

# It writes a message twice, and goes on.
SCRIPT = """
import os, sys
from lupin_bridge.console import say, tell
say("one")
tell("first", "second")
say("two")
os.system("echo three; echo four >&2")
sys.exit(7)
"""


def run(streams: str) -> subprocess.CompletedProcess[str]:
    """The script, with its streams redirected by a shell."""
    command = f'exec "$@" {streams}'
    return subprocess.run(
        ["sh", "-c", command, "sh", sys.executable, "-c", SCRIPT],
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )


NO_ROOM = "lupin-twin: cannot write to the standard output: No space left on device\n"


@pytest.mark.parametrize(
    ("streams", "out", "err"),
    [
        ("", "first\nsecond\nthree\n", "lupin-twin: one\nlupin-twin: two\nfour\n"),
        ("2>/dev/full", "first\nsecond\nthree\n", ""),
        (">/dev/full 2>/dev/full", "", ""),
    ],
)
def test_output_that_cannot_be_written_ends_nothing(streams: str, out: str, err: str) -> None:
    ended = run(streams)
    assert (ended.returncode, ended.stdout, ended.stderr) == (7, out, err)


def test_a_full_output_is_reported_once() -> None:
    ended = run(">/dev/full")
    assert ended.returncode == 7
    assert ended.stderr.count(NO_ROOM) == 1
    assert "Error" not in ended.stderr


def test_a_closed_pipe_is_silent(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    reader, writer = os.pipe()
    os.close(reader)
    with os.fdopen(writer, "w") as pipe:
        monkeypatch.setattr(sys, "stdout", pipe)
        tell("first")
        assert capsys.readouterr().err == ""
        monkeypatch.setattr(sys, "stderr", pipe)
        for _ in range(2):
            say("nobody hears it")
        # Nothing stays buffered that would fail again when it is closed.
    monkeypatch.setattr(sys, "stderr", None)
    say("nobody hears it")


def test_a_line_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    say("one\n  and two")
    assert capsys.readouterr().err == "lupin-twin: one and two\n"
