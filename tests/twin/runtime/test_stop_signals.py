"""Stop signals wait until they are handled; in a process of its own."""

import os
import signal
import subprocess
import sys

import pytest

from tests.support.waiting import PATIENCE_S

SCRIPT = """
from lupin_twin.runtime import process
process.block()
print("blocked", flush=True)
input()
process.wait()
print("asked", flush=True)
"""


@pytest.mark.parametrize("stop", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_waits_until_it_is_handled(stop: signal.Signals) -> None:
    with subprocess.Popen(
        [sys.executable, "-c", SCRIPT], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        assert process.stdout.readline() == "blocked\n"
        os.kill(process.pid, stop)
        process.stdin.write("\n")
        process.stdin.flush()
        assert process.stdout.readline() == "asked\n"
        assert process.wait(PATIENCE_S) == 0


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
