"""The parts of a bench with live clients: a server with its robot, clients, and their results."""

import json
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Any, Self
from urllib.parse import urlsplit

from tests.support.domains import own_domain, ros_env
from tests.support.proc_stat import cpu_s, proportional_mb
from tests.support.processes import Process, children_of, limits, lupin_twin, url_of

CLIENTS_A_PROCESS = 1_250
# Python starts and imports; then all clients connect at once.
HEAD_START_S = 1.5
# 20,000 messages, one batch after the other.
FILL_PATIENCE_S = 300.0
# The bridge may send slightly more often than the robot changes it: at exactly the robot's rate,
# a change would wait up to a period for its turn, and that would be measured.
HEADROOM = 1.2
# The tests let ROS check every field of every message, which costs time; production does not.
AS_IN_USE = {"ROS_PYTHON_CHECK_FIELDS": "0"}


@dataclass(slots=True)
class Seen:
    """The results of all clients in one measurement; `delays_s` is sorted."""

    delays_s: list[float]
    received: Counter[int]
    frame_bytes: float

    def delivered(self, clients: int) -> float:
        """The share of all frames made, times clients, that arrived."""
        made = max(self.received) - min(self.received) + 1
        return self.received.total() / (made * clients)

    def delay_ms(self, share: float) -> float:
        """A quantile of the delays, ms."""
        return 1e3 * self.delays_s[min(len(self.delays_s) - 1, int(share * len(self.delays_s)))]


class Clients:
    """The client processes of one load."""

    def __init__(self, port: int, count: int, path: str = "/ws/state"):
        self._processes = []
        number = -(-count // CLIENTS_A_PROCESS)
        connect_at = time.monotonic() + HEAD_START_S
        for index in range(number):
            share = count // number + (index < count % number)
            arguments = [
                *("--port", port, "--path", path),
                *("--clients", share, "--connect-at", connect_at),
            ]
            self._processes.append(
                subprocess.Popen(
                    [sys.executable, "-m", "tests.bench.live_clients", *map(str, arguments)],
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    text=True,
                )
            )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for process in self._processes:
            process.kill()
            process.communicate()

    def joined_s(self) -> float:
        """Wait for every client's first state; the time that the last one took, s."""
        return max(max(map(float, reported["joined_s"])) for reported in self._reported())

    def measure(self, start_s: float, end_s: float) -> Seen:
        """Measure changes published in a stretch of the monotonic clock."""
        for process in self._processes:
            assert process.stdin is not None
            process.stdin.write(f"measure {start_s} {end_s}\n")
            process.stdin.flush()
        seen = Seen([], Counter(), 0.0)
        for reported in self._reported():
            seen.delays_s += reported["delays_s"]
            seen.received.update({int(seq): n for seq, n in reported["received"].items()})
            seen.frame_bytes = max(seen.frame_bytes, reported["frame_bytes"])
        seen.delays_s.sort()
        return seen

    def _reported(self) -> Iterator[dict[str, Any]]:
        for process in self._processes:
            assert process.stdout is not None
            line = process.stdout.readline()
            if not line:
                raise RuntimeError(f"a client process ended with {process.wait()}")
            yield json.loads(line)


@dataclass(slots=True)
class Server:
    """A `lupin-twin serve` with a robot that keeps changing it."""

    process: Process
    port: int

    @property
    def pids(self) -> list[int]:
        return [self.process.pid, *children_of(self.process.pid, b"")]

    def cpu_s(self) -> float:
        """Processor time of the server and its child processes so far, s."""
        return sum(map(cpu_s, self.pids))

    def memory_mb(self) -> float:
        return sum(map(proportional_mb, self.pids))


@contextmanager
def serving(tags: int, rate_hz: float, *options: str, frames_hz: float = 0) -> Iterator[Server]:
    """A server and its robot, once the twin has all tags; `frames_hz` 0: a frame for each scan."""
    with ExitStack() as stack:
        domain = stack.enter_context(own_domain())
        pace = limits(frames_per_s=frames_hz or rate_hz * HEADROOM)
        server = stack.enter_context(
            lupin_twin(domain, "serve", *pace, *options, afresh=True, **AS_IN_USE)
        )
        url = url_of(server)
        port = urlsplit(url).port
        assert port is not None
        arguments = ("--domain", domain, "--url", url, "--tags", tags, "--rate-hz", rate_hz)
        robot = stack.enter_context(
            Process(
                [sys.executable, "-m", "tests.bench.live_robot", *map(str, arguments)],
                ros_env(domain, **AS_IN_USE),
            )
        )
        robot.wait_for_output("filled", timeout_s=FILL_PATIENCE_S)
        yield Server(server, port)
