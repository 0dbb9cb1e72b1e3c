"""A wall clock of a test's own, which may be wrong, and is set right while a process runs."""

import struct
import subprocess
import time
from pathlib import Path


class WallClock:
    """The system's clock and `off_s`; `env` gives it to a process and all that it starts."""

    def __init__(self, folder: Path, off_s: int = 0) -> None:
        self._file = folder / "wall-clock"
        self._file.write_bytes(bytes(8))
        library = folder / "wall_clock.so"
        source = Path(__file__).with_name("wall_clock.c")
        subprocess.run(
            ["cc", "-shared", "-fPIC", "-O1", "-o", library, source, "-ldl"], check=True, timeout=60
        )
        self.env = {"LD_PRELOAD": str(library), "WALL_CLOCK": str(self._file)}
        self.be_off(off_s)

    def be_off(self, off_s: int) -> None:
        """Set it: it is so much ahead of the right one, or behind, at once."""
        self.off_s = off_s
        with self._file.open("r+b") as file:
            file.write(struct.pack("=q", off_s * 1_000_000_000))

    def now_s(self) -> float:
        """What it says."""
        return time.time() + self.off_s
