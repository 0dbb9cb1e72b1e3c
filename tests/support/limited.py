"""`lupin-twin` with other limits or faults: for tests only.

`python -m tests.support.limited [--limit NAME=VALUE] [--constant MODULE:NAME=VALUE]
[--raise MODULE:NAME:MARKER[:TIMES]] [--hang MODULE:NAME:MARKER] ROLE ...`, each as often as needed,
is the command `lupin-twin ROLE ...`, whose `Limits` and modules have these values. `--raise` lets a
function or method fail when the marker occurs in its arguments' text, TIMES times (1 without it);
with `--hang` it prints "hangs" and never returns.
"""

import argparse
import functools
import json
import sys
import threading
from collections.abc import Callable, Sequence
from functools import partial
from importlib import import_module
from typing import Any

from lupin_bridge.cli import command as cli_command
from lupin_bridge.serving.admission import Limits
from lupin_twin.runtime.process import limit_blas_threads


def _values(pairs: Sequence[str]) -> dict[str, Any]:
    return {name: json.loads(value) for name, _, value in (pair.partition("=") for pair in pairs)}


def _fail(path: str) -> None:
    raise RuntimeError(f"sabotage of {path}")


def _never_come_back(path: str) -> None:
    print(f"{path} hangs", flush=True)
    threading.Event().wait()


def _sabotage(fault: str, do: Callable[[str], None]) -> None:
    """Call `do(path)` before a function, the first times that the marker is in its arguments."""
    module, path, marker, *times = fault.split(":")
    *owners, name = path.split(".")
    owner = functools.reduce(getattr, owners, import_module(module))
    function: Callable[..., Any] = getattr(owner, name)
    left = int(times[0]) if times else 1

    @functools.wraps(function)
    def failing(*args: Any, **kwargs: Any) -> Any:
        nonlocal left
        if left and marker in repr((args, kwargs)):
            left -= 1
            do(path)
        return function(*args, **kwargs)

    setattr(owner, name, failing)


def command() -> None:
    parser = argparse.ArgumentParser(allow_abbrev=False)
    for name in ("--limit", "--constant", "--raise", "--hang"):
        parser.add_argument(name, action="append", default=[])
    options, rest = parser.parse_known_args()
    sys.argv[1:] = rest
    limit_blas_threads()
    # Before anything else has imported the failing function.
    for fault in vars(options)["raise"]:
        _sabotage(fault, _fail)
    for hang in options.hang:
        _sabotage(hang, _never_come_back)
    from lupin_bridge.cli import roles

    limits = partial(Limits, **_values(options.limit))
    vars(roles).update(Limits=limits)
    for place, value in _values(options.constant).items():
        module, _, name = place.partition(":")
        vars(import_module(module))[name] = value
    cli_command.command()


if __name__ == "__main__":
    command()
