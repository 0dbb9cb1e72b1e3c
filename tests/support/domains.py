"""One ROS domain per test, also when several test runs share the machine; what dead ones left."""

import fcntl
import os
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

# 0 is the common default; above 101 the ports of DDS overlap those of outgoing connections.
DOMAINS = range(1, 102)


@contextmanager
def own_domain() -> Iterator[int]:
    """Lease a ROS_DOMAIN_ID that nothing else on this machine uses."""
    folder = Path(tempfile.gettempdir()) / "lupin-twin-test-domains"
    folder.mkdir(exist_ok=True)
    # Processes start at different numbers, so that a domain is not reused right after its last use.
    offset = os.getpid() * 7 + _leases_so_far()
    for step in range(len(DOMAINS)):
        domain = DOMAINS[(offset + step) % len(DOMAINS)]
        with (folder / str(domain)).open("w") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                continue
            if _is_lived_in(domain):
                continue
            _remove_ports_of(domain)
            yield domain
            return
    raise RuntimeError("all ROS domains are in use")


def _is_lived_in(domain: int) -> bool:
    """Whether a process that no test has started uses the domain, such as a twin at work.

    It would receive what tests publish, and vice versa. Found by the ports of DDS.
    """
    table = Path("/proc/net/udp").read_text(encoding="ascii").splitlines()[1:]
    addresses = (line.split()[1] for line in table)
    return any(int(address.rpartition(":")[2], 16) in _ports_of(domain) for address in addresses)


def _ports_of(domain: int) -> range:
    """The ports that RTPS 2.3, section 9.6.2.3, gives a domain."""
    return range(7400 + 250 * domain, 7400 + 250 * (domain + 1))


def _remove_ports_of(domain: int) -> None:
    """Remove the ports of killed processes in a domain, which would block others."""
    for port in _ports_of(domain):
        for name in (f"fastrtps_port{port}", f"fastrtps_port{port}_el"):
            (SHARED_MEMORY / name).unlink(missing_ok=True)
        (SHARED_MEMORY / f"sem.fastrtps_port{port}_mutex").unlink(missing_ok=True)


_leases = 0


def _leases_so_far() -> int:
    global _leases  # noqa: PLW0603  # a counter of this process
    _leases += 1
    return _leases


def ros_env(domain: int, **more: str) -> dict[str, str]:
    """The environment of a process in a ROS domain of this machine alone."""
    ours = {name: it for name, it in os.environ.items() if name != "FASTRTPS_DEFAULT_PROFILES_FILE"}
    return {
        **ours,
        "ROS_DOMAIN_ID": str(domain),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        **more,
    }


SHARED_MEMORY = Path("/dev/shm")
LOCK = "_el"
# A process that is just starting has created its files and not yet locked them.
YOUNG_S = 10.0


def remove_what_the_dead_left(folder: Path = SHARED_MEMORY) -> int:
    """Remove the segments of dead processes; returns how many.

    A participant's segment, half a megabyte, has a file beside it that its process locks.
    An unlocked one is unused. This does not hold for ports, which several processes share,
    and which are small.
    """
    removed = 0
    for lock in folder.glob(f"fastrtps_*{LOCK}"):
        segment = lock.with_name(lock.name.removesuffix(LOCK))
        if segment.name.startswith("fastrtps_port"):
            continue
        with suppress(FileNotFoundError, PermissionError), lock.open("rb") as file:
            if time.time() - lock.stat().st_mtime < YOUNG_S:
                continue
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                continue
            segment.unlink(missing_ok=True)
            lock.unlink()
            removed += 1
    return removed
