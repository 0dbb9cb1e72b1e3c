"""`lupin-twin` with other limits than it has, or of another world: what a test cannot wait for.

`python -m tests.support.limited [--limit NAME=VALUE] [--world NAME=VALUE]
[--constant MODULE:NAME=VALUE] ROLE ...`, each as often as wanted, is the command
`lupin-twin ROLE ...`, whose `Limits`, `World` and modules have these values.
"""

import argparse
import json
import sys
from collections.abc import Sequence
from functools import partial
from importlib import import_module
from typing import Any

from lupin_bridge.cli import command as cli_command
from lupin_bridge.serving.admission import Limits
from lupin_twin.core.parameters import World
from lupin_twin.runtime.process import limit_blas_threads


def _values(pairs: Sequence[str]) -> dict[str, Any]:
    return {name: json.loads(value) for name, _, value in (pair.partition("=") for pair in pairs)}


def command() -> None:
    parser = argparse.ArgumentParser(allow_abbrev=False)
    parser.add_argument("--limit", action="append", default=[])
    parser.add_argument("--world", action="append", default=[])
    parser.add_argument("--constant", action="append", default=[])
    options, rest = parser.parse_known_args()
    sys.argv[1:] = rest
    limit_blas_threads()
    from lupin_bridge.cli import roles

    limits = partial(Limits, **_values(options.limit))
    vars(roles).update(Limits=limits, World=partial(World, **_values(options.world)))
    for place, value in _values(options.constant).items():
        module, _, name = place.partition(":")
        vars(import_module(module))[name] = value
    cli_command.command()


if __name__ == "__main__":
    command()
