"""A real file system of a few MB, of a child process's own, that can be full and have room again.

A tmpfs in a mount namespace of the child's (`unshare`): nobody else sees it, and it goes with the
child. Where no namespace may be made, as in some containers, files of the child that may not grow
(RLIMIT_FSIZE): the write fails as really, with EFBIG in the place of ENOSPC.
"""

from __future__ import annotations

import contextlib
import resource
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

SIZE_MB = 4
_BALLAST = "ballast"
_NO_LIMIT = (resource.RLIM_INFINITY, resource.RLIM_INFINITY)


@cache
def namespace() -> tuple[str, ...] | None:
    """The command that runs another in a mount namespace; None: that is not allowed here."""
    unshare = shutil.which("unshare")
    for options in (("-m",), ("-rm",)):
        words = (unshare or "unshare", *options, "--", "sh", "-c")
        tried = [*words, "mount -t tmpfs none /mnt"]
        with contextlib.suppress(OSError):
            if subprocess.run(tried, capture_output=True, check=False).returncode == 0:
                return words
    return None


@dataclass
class SmallDisk:
    """A folder that is a small disk to the command that runs on it."""

    folder: Path
    pid: int = 0

    @property
    def is_real(self) -> bool:
        """Whether it is a file system, and no limit on files."""
        return namespace() is not None

    def command(self, *words: str) -> Sequence[str]:
        """The command, run on the disk; say its process's `pid` afterwards."""
        if (inside := namespace()) is None:
            return words
        mount = f'mount -t tmpfs -o size={SIZE_MB}m none "$0" && exec "$@"'
        return [*inside, mount, str(self.folder), *words]

    def fill(self) -> None:
        """Leave no room."""
        if not self.is_real:
            largest = max((file.stat().st_size for file in self.folder.rglob("*")), default=0)
            resource.prlimit(self.pid, resource.RLIMIT_FSIZE, (largest, resource.RLIM_INFINITY))
            return
        ballast = self.seen() / _BALLAST
        with ballast.open("ab", buffering=0) as file, contextlib.suppress(OSError):
            while file.write(bytes(4096)):
                pass

    def free(self) -> None:
        """Give the room back."""
        if not self.is_real:
            resource.prlimit(self.pid, resource.RLIMIT_FSIZE, _NO_LIMIT)
            return
        (self.seen() / _BALLAST).unlink()

    def seen(self) -> Path:
        """The folder as the child sees it, for whoever is outside."""
        return Path(f"/proc/{self.pid}/root{self.folder}") if self.is_real else self.folder
