"""Programs that neither Python's nor Node's registry has: `.ci/tools` installs them."""

import os
import shutil


def program(name: str) -> str:
    """The path of a program, also where only root's PATH has it."""
    found = shutil.which(name, path=f"{os.environ['PATH']}:/usr/sbin:/sbin")
    assert found is not None, f"{name} is needed: .ci/tools installs it"
    return found
