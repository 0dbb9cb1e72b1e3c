from __future__ import annotations

import subprocess
import sys
import time

LEAVE = """
import sys, threading
from lupin_twin.leaving import leave
if sys.argv[1] == "busy":
    threading.Thread(target=threading.Event().wait).start()
print("said")
leave(3)
"""


def test_the_process_ends_with_its_code_whatever_a_thread_does() -> None:
    for how in ("idle", "busy"):
        start_s = time.monotonic()
        ended = subprocess.run(
            [sys.executable, "-c", LEAVE, how],
            check=False,
            capture_output=True,
            text=True,
            timeout=20,
        )
        assert (ended.returncode, ended.stdout, ended.stderr) == (3, "said\n", "")
        assert time.monotonic() - start_s < 5.0
