"""A folder for what twins keep, instead of the user's: with nobody's memory in it."""

import atexit
import os
import shutil
import tempfile


def use_own() -> str:
    """Let this process and all that it starts keep things in a new folder, removed at its end."""
    folder = tempfile.mkdtemp(prefix="lupin-twin-test-state-")
    os.environ["XDG_STATE_HOME"] = folder
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder
