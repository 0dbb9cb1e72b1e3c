"""The product with faults built in, for tests: nothing in the product knows of them.

`python -m tests.support.sabotage [--raise MODULE:NAME:MARKER[:TIMES]] [--hang MODULE:NAME:MARKER]
PROGRAM ...` runs the module PROGRAM with the arguments behind it. `--raise`, as
often as wanted, lets a function or method fail when the marker occurs in its arguments' text, TIMES
times (1 without it), and work otherwise; with `--hang` it says "hangs" and never comes back.
"""

import argparse
import functools
import runpy
import sys
import threading
from collections.abc import Callable, Sequence
from importlib import import_module
from typing import Any

from tests.support.domains import ros_env
from tests.support.processes import Process


def sabotaged(domain: int, faults: Sequence[str], program: str, *args: str, **env: str) -> Process:
    """A process that runs a module with faults, each as it stands on the command line."""
    command = [sys.executable, "-m", "tests.support.sabotage", *faults, program, *args]
    return Process(command, ros_env(domain, **env))


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--raise", dest="faults", action="append", default=[])
    parser.add_argument("--hang", dest="hangs", action="append", default=[])
    parser.add_argument("program")
    parser.add_argument("args", nargs=argparse.REMAINDER)
    options = parser.parse_args()
    for fault in options.faults:
        module, path, marker, *times = fault.split(":")
        sabotage(module, path, marker, int(times[0]) if times else 1)
    for hang in options.hangs:
        module, path, marker = hang.split(":")
        sabotage(module, path, marker, 1, never_come_back)
    sys.argv = [options.program, *options.args]
    runpy.run_module(options.program, run_name="__main__", alter_sys=True)


def fail(path: str) -> None:
    """Raise."""
    raise RuntimeError(f"sabotage of {path}")


def never_come_back(path: str) -> None:
    """Wait for ever."""
    print(f"{path} hangs", flush=True)
    threading.Event().wait()


def sabotage(
    module: str, path: str, marker: str, times: int, do: Callable[[str], None] = fail
) -> None:
    """Let a function `do(path)` first, the first `times` times that the marker is in its arguments.

    By default it fails.
    """
    *owners, name = path.split(".")
    owner = functools.reduce(getattr, owners, import_module(module))
    function: Callable[..., Any] = getattr(owner, name)
    left = times

    @functools.wraps(function)
    def failing(*args: Any, **kwargs: Any) -> Any:
        nonlocal left
        if left and marker in repr((args, kwargs)):
            left -= 1
            do(path)
        return function(*args, **kwargs)

    setattr(owner, name, failing)


if __name__ == "__main__":
    main()
