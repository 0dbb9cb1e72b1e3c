"""A process ends after a stop signal, whatever hangs; `test_cli` has signals during the start."""

import signal
import subprocess
import sys

from tests.support.waiting import PATIENCE_S

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
