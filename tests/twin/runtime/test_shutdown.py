"""How a command starts and ends; in its own process."""

import os
import subprocess
import sys

import pytest

from lupin_twin.runtime.process import INTERRUPTED, NOT_WRITTEN
from tests.support.waiting import PATIENCE_S

LEAVE = """
import sys, threading
from lupin_twin.runtime.process import exit_after
how, end = sys.argv[1:]
if how == "busy":
    threading.Thread(target=threading.Event().wait).start()

def main():
    print("said")
    if end == "exits":
        sys.exit(3)
    if end == "explains":
        sys.exit("why")
    if end == "raises":
        raise ValueError("why")
    if end == "is interrupted":
        raise KeyboardInterrupt
    if end == "says why":
        sys.stderr.write("why\\n")
    return 0 if end == "is content" else 3

exit_after(main)
"""


@pytest.mark.parametrize(
    ("how", "end"),
    [("idle", "returns"), *(("busy", end) for end in ("returns", "exits", "explains", "raises"))],
)
def test_the_process_ends_with_its_code_whatever_a_thread_does(how: str, end: str) -> None:
    ended = left(how, end, "")
    failed = end in ("explains", "raises")
    assert (ended.returncode, ended.stdout) == (1 if failed else 3, "said\n")
    assert ("why\n" in ended.stderr) == failed
    assert ("Traceback" in ended.stderr) == (end == "raises")


def left(how: str, end: str, shell: str) -> subprocess.CompletedProcess[str]:
    """The ended process. Its standard streams are as the shell words say; Python buffers lines."""
    return subprocess.run(
        ["sh", "-c", f'exec "$@" {shell}', "sh", sys.executable, "-c", LEAVE, how, end],
        check=False,
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        env={name: it for name, it in os.environ.items() if name != "PYTHONUNBUFFERED"},
    )


@pytest.mark.parametrize("how", ["idle", "busy"])
def test_ctrl_c_ends_it_without_a_traceback(how: str) -> None:
    ended = left(how, "is interrupted", "")
    assert (ended.returncode, ended.stdout, ended.stderr) == (INTERRUPTED, "said\n", "")


@pytest.mark.parametrize("how", ["idle", "busy"])
def test_output_that_cannot_be_written_does_not_change_the_exit_code(how: str) -> None:
    for end, code in (("explains", 1), ("raises", 1), ("returns", 3), ("is content", 0)):
        ended = left(how, end, "2>/dev/full")
        assert (ended.returncode, ended.stdout) == (code, "said\n"), end
    for end, code in (("is content", NOT_WRITTEN), ("returns", 3)):
        ended = left(how, end, ">/dev/full")
        why = "cannot write to the standard output: No space left on device\n"
        assert (ended.returncode, ended.stderr) == (code, "" if code == 3 else why)
