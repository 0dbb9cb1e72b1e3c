"""The cost of a process, from /proc (proc_pid_stat(5), proc_pid_status(5))."""

import os
from contextlib import suppress
from pathlib import Path

_TICKS_PER_S = os.sysconf("SC_CLK_TCK")
_PAGE_BYTES = os.sysconf("SC_PAGE_SIZE")


def cpu_s(pid: int) -> float:
    """Processor time of all its threads so far, user and system, s."""
    # The name is in brackets and may contain blanks and brackets of its own.
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / _TICKS_PER_S


def waited_s(pid: int) -> float:
    """How long its current threads have waited for a core so far, s (schedstats, Linux)."""
    waited_ns = 0
    for task in Path(f"/proc/{pid}/task").iterdir():
        with suppress(FileNotFoundError, ProcessLookupError):  # it has just ended
            waited_ns += int((task / "schedstat").read_text(encoding="ascii").split()[1])
    return waited_ns / 1e9


def resident_mb(pid: int) -> float:
    """Resident memory, MB (10^6 bytes)."""
    pages = int(Path(f"/proc/{pid}/statm").read_text(encoding="ascii").split()[1])
    return pages * _PAGE_BYTES / 1e6


def open_files(pid: int) -> int:
    """How many descriptors it has open, without the journal's and those to its child processes.

    Those are open from the first query of the past on, or after some seconds.
    """
    own = {line.split()[6] for line in Path("/proc/net/unix").read_text("ascii").splitlines()[1:]}
    files = (_target(path) for path in Path(f"/proc/{pid}/fd").iterdir())
    return sum(
        not file.startswith(("pipe:", "anon_inode:[pidfd]"))
        and ".sqlite" not in file
        and file.removeprefix("socket:[").rstrip("]") not in own
        for file in files
    )


def _target(descriptor: Path) -> str:
    """The descriptor's target (proc_pid_fd(5)); empty once it is closed."""
    try:
        return str(descriptor.readlink())
    except FileNotFoundError:
        return ""


def reset_peak(pid: int) -> None:
    """Restart `peak_mb` (proc_pid_clear_refs(5))."""
    Path(f"/proc/{pid}/clear_refs").write_text("5", encoding="ascii")


def proportional_mb(pid: int) -> float:
    """Resident memory, MB; a page that processes share counts in parts (proc_pid_smaps(5))."""
    text = Path(f"/proc/{pid}/smaps_rollup").read_text(encoding="ascii")
    return int(text.partition("\nPss:")[2].split()[0]) * 1024 / 1e6


def peak_mb(pid: int) -> float:
    """The most memory that was resident at any time, MB."""
    for line in Path(f"/proc/{pid}/status").read_text(encoding="utf-8").splitlines():
        if line.startswith("VmHWM:"):
            return int(line.split()[1]) * 1_024 / 1e6
    raise AssertionError(f"/proc/{pid}/status has no line VmHWM")
