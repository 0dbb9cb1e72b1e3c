"""The end of a process, whatever hangs in it, and the limit of its threads."""

import os
import signal
import subprocess
import sys

import pytest

from lupin_twin.runtime.process import INTERRUPTED, limit_blas_threads
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
    return 3

exit_after(main)
"""


@pytest.mark.parametrize(
    ("how", "end"),
    [("idle", "returns"), *(("busy", end) for end in ("returns", "exits", "explains", "raises"))],
)
def test_the_process_ends_with_its_code_whatever_a_thread_does(how: str, end: str) -> None:
    ended = left(how, end)
    failed = end in ("explains", "raises")
    assert (ended.returncode, ended.stdout) == (1 if failed else 3, "said\n")
    assert ("why\n" in ended.stderr) == failed
    assert ("Traceback" in ended.stderr) == (end == "raises")


def left(how: str, end: str) -> subprocess.CompletedProcess[str]:
    """The ended process; Python buffers its lines."""
    return subprocess.run(
        [sys.executable, "-c", LEAVE, how, end],
        check=False,
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        env={name: it for name, it in os.environ.items() if name != "PYTHONUNBUFFERED"},
    )


@pytest.mark.parametrize("how", ["idle", "busy"])
def test_ctrl_c_ends_it_without_a_traceback(how: str) -> None:
    ended = left(how, "is interrupted")
    assert (ended.returncode, ended.stdout, ended.stderr) == (INTERRUPTED, "said\n", "")


# Before the process ends: one holds Python's lock, the other runs after Python.
HANGS = {
    "a call that keeps the interpreter": "ctypes.PyDLL(None).sleep(60)",
    "what runs after Python": "ctypes.CDLL(None).on_exit(ctypes.CDLL(None).pause, None)",
}
HANG = """
import ctypes
from lupin_twin.runtime import process
process.block()
print("blocked", flush=True)
process.wait(1)
"""


def test_the_process_ends_whatever_hangs_at_the_end() -> None:
    processes = {
        what: subprocess.Popen(
            [sys.executable, "-c", HANG + call],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        for what, call in HANGS.items()
    }
    for process in processes.values():
        assert process.stdout is not None
        assert process.stdout.readline() == "blocked\n"
        process.send_signal(signal.SIGINT)
    codes, message = {}, {}
    for what, process in processes.items():
        with process:
            _, message[what] = process.communicate(timeout=PATIENCE_S)
            codes[what] = process.returncode
    assert codes == dict(zip(HANGS, (1, -signal.SIGALRM), strict=True))
    # The hanging place is logged while the interpreter still runs.
    assert "Timeout (0:00:01)!" in message["a call that keeps the interpreter"]


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
