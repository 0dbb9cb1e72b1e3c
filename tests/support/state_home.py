"""An empty state folder for twins, instead of the user's."""

import atexit
import os
import shutil
import tempfile


def use_own() -> str:
    """Let this process and all its children use a new state folder, removed at its end."""
    folder = tempfile.mkdtemp(prefix="lupin-twin-test-state-")
    os.environ["XDG_STATE_HOME"] = folder
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder
