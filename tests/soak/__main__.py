"""`make soak`: too slow for every test run: many kills, and eight hours of writing."""

import importlib
import sys

from lupin_twin.runtime.process import exit_after
from tests.support.state_home import use_own

SOAKS = ("kills", "archive_kills", "hours")


def main() -> int:
    """Run the soaks named on the command line, or all; 1 if one failed."""
    use_own()
    code = 0
    for name in sys.argv[1:] or SOAKS:
        print(f"\n=== {name}", flush=True)
        code |= 0 if importlib.import_module(f"tests.soak.{name}").main() else 1
    return code


if __name__ == "__main__":
    exit_after(main)
