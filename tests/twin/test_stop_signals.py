"""Stop signals wait until they are asked for; in a process of its own."""

from __future__ import annotations

import os
import signal
import subprocess
import sys

import pytest

SCRIPT = """
from lupin_twin import stop_signals
stop_signals.block()
print("blocked", flush=True)
input()
stop_signals.wait()
print("asked", flush=True)
"""


@pytest.mark.parametrize("stop", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_waits_until_it_is_asked_for(stop: signal.Signals) -> None:
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
        assert process.wait(20) == 0
