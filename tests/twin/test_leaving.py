from __future__ import annotations

import subprocess
import sys

import pytest

from tests.support.waiting import PATIENCE_S

LEAVE = """
import sys, threading
from lupin_twin.leaving import leave_after
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
    return 3

leave_after(main)
"""


@pytest.mark.parametrize(
    ("how", "end"),
    [("idle", "returns"), *(("busy", end) for end in ("returns", "exits", "explains", "raises"))],
)
def test_the_process_ends_with_its_code_whatever_a_thread_does(how: str, end: str) -> None:
    ended = subprocess.run(
        [sys.executable, "-c", LEAVE, how, end],
        check=False,
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
    )
    failed = end in ("explains", "raises")
    assert (ended.returncode, ended.stdout) == (1 if failed else 3, "said\n")
    assert ("why\n" in ended.stderr) == failed
    assert ("Traceback" in ended.stderr) == (end == "raises")
