"""The live bridge under load: `python -m tests.bench.bench_live [--quick]`, or `make bench-live`.

A real `lupin-twin serve`, a robot in a process of its own that changes one tag at the row's rate
over DDS, and clients in further processes. All share this machine, so the clients' own work weighs
on the figures too. Rows of the same twin and rate share a server.

What the columns say:

- delay: from the robot's `publish()` until the client's process has read the frame that carries
  the change. In it are DDS, the twin, the bridge's pacing, serialisation, the fan-out, the kernel
  and the client's own queue. Both ends read CLOCK_MONOTONIC, which all processes share.
- delivered: the share of (frames made × clients) that arrived. A frame that a slow client
  skipped, as the bridge intends, counts as not delivered.
- joined: all clients connect in the same moment; the time until the last has its first state.
- cores: the server's processor time, all threads, over the time measured.
- memory: the server's resident memory at the end, MB.
"""

from __future__ import annotations

import argparse
import itertools
import json
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Any, Self
from urllib.parse import urlsplit

from tests.bench.live_outages import measure_outages
from tests.support.domains import own_domain, ros_env
from tests.support.proc_stat import cpu_s, resident_mb, tcp_buffers_mb
from tests.support.processes import Process, lupin_twin, url_of
from tests.support.state_home import use_own

CLIENTS_A_PROCESS = 1_250
# Python starts and imports; then all clients connect at once.
HEAD_START_S = 1.5
SETTLE_S = 1.0
# 20,000 messages, one batch after the other.
FILL_PATIENCE_S = 300.0
# The bridge may send a little more often than the robot causes it to: at exactly the robot's rate,
# a change would wait up to a period for its turn, and that is what one would measure.
HEADROOM = 1.2
# The tests let ROS check every field of every message, which costs time; nobody else does.
AS_IN_USE = {"ROS_PYTHON_CHECK_FIELDS": "0"}


@dataclass(frozen=True, slots=True)
class Load:
    """One row: so many clients of a twin with so many tags that changes so often."""

    clients: int
    rate_hz: float = 10.0
    tags: int = 30
    path: str = "/ws/state"
    measure_s: float = 8.0

    @property
    def server(self) -> tuple[int, float]:
        """What the server and the robot are started with: tags and rate."""
        return self.tags, self.rate_hz


@dataclass(slots=True)
class Seen:
    """What the clients saw in one measurement; `delays_s` is sorted."""

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

    def delays(self) -> str:
        """The delays, for a person."""
        return f"median {self.delay_ms(0.5):.1f} ms, p99 {self.delay_ms(0.99):.1f} ms"


class Clients:
    """The client processes of one load."""

    def __init__(self, port: int, count: int, path: str = "/ws/state", *, deaf: bool = False):
        self.count = count
        self._processes = []
        number = -(-count // CLIENTS_A_PROCESS)
        connect_at = time.monotonic() + HEAD_START_S
        for index in range(number):
            share = count // number + (index < count % number)
            arguments = [
                *("--port", port, "--path", path),
                *("--clients", share, "--connect-at", connect_at),
                *(["--deaf"] if deaf else []),
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
        return max(max(map(float, told["joined_s"])) for told in self._told())

    def measure(self, start_s: float, end_s: float) -> Seen:
        """Measure changes published in a stretch of the monotonic clock."""
        self._command(f"measure {start_s} {end_s}")
        seen = Seen([], Counter(), 0.0)
        for told in self._told():
            seen.delays_s += told["delays_s"]
            seen.received.update({int(seq): n for seq, n in told["received"].items()})
            seen.frame_bytes = max(seen.frame_bytes, told["frame_bytes"])
        seen.delays_s.sort()
        return seen

    def closed_s(self) -> list[float]:
        """When the server closed clients, s after they connected."""
        self._command("closed")
        return sorted(at for told in self._told() for at in told["closed_s"])

    def _command(self, text: str) -> None:
        for process in self._processes:
            assert process.stdin is not None
            process.stdin.write(text + "\n")
            process.stdin.flush()

    def _told(self) -> Iterator[dict[str, Any]]:
        for process in self._processes:
            assert process.stdout is not None
            line = process.stdout.readline()
            if not line:
                raise RuntimeError(f"a client process ended with {process.wait()}")
            yield json.loads(line)


@dataclass(slots=True)
class Server:
    """A `lupin-twin serve` with a robot that keeps it changing."""

    process: Process
    port: int

    def cores_since(self, start_s: float, cpu_before_s: float) -> float:
        """Processor time per time since a moment, in cores."""
        return (cpu_s(self.process.pid) - cpu_before_s) / (time.monotonic() - start_s)


@contextmanager
def serving(tags: int, rate_hz: float, *options: str) -> Iterator[Server]:
    """A server and its robot, once the twin has all tags."""
    with ExitStack() as stack:
        domain = stack.enter_context(own_domain())
        pace = ("--max-rate-hz", str(rate_hz * HEADROOM))
        server = stack.enter_context(lupin_twin(domain, "serve", *pace, *options, **AS_IN_USE))
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


def measure_load(server: Server, load: Load) -> list[str]:
    """One row of the table."""
    with Clients(server.port, load.clients, load.path) as clients:
        joined_s = clients.joined_s()
        start_s = time.monotonic() + SETTLE_S
        time.sleep(SETTLE_S)
        before_s = cpu_s(server.process.pid)
        # The clients answer when it is over and drained; the processor time ends with them.
        seen = clients.measure(start_s, start_s + load.measure_s)
        cores = server.cores_since(start_s, before_s)
        memory = resident_mb(server.process.pid)
    return [
        f"{load.tags:,}",
        f"{load.clients:,}",
        f"{load.rate_hz:g}",
        "delta" if "delta=1" in load.path else "full",
        f"{seen.frame_bytes / 1e3:,.1f}",
        f"{100 * seen.delivered(load.clients):.2f}",
        f"{seen.delay_ms(0.5):.1f}",
        f"{seen.delay_ms(0.99):.1f}",
        f"{joined_s:.2f}",
        f"{cores:.2f}",
        f"{memory:.0f}",
    ]


HEADINGS = (
    *("tags", "clients", "Hz", "frames", "kB", "delivered %", "median ms", "p99 ms"),
    *("joined s", "cores", "memory MB"),
)


def measure_stuck(stuck: int, seconds: float, timeout_s: float) -> str:
    """Clients that never read, beside healthy ones; returns lines of text."""
    rate_hz, healthy_clients = 50.0, 10
    with (
        serving(30, rate_hz, "--client-timeout-s", str(timeout_s)) as server,
        Clients(server.port, healthy_clients) as healthy,
    ):
        healthy.joined_s()
        now_s = time.monotonic()
        before = healthy.measure(now_s, now_s + 5.0)
        memory, kernel = resident_mb(server.process.pid), tcp_buffers_mb()
        peak, kernel_peak = memory, kernel
        with Clients(server.port, stuck, deaf=True) as deaf:
            end_s = time.monotonic() + HEAD_START_S + seconds
            delays: list[float] = []
            while (now_s := time.monotonic()) < end_s:
                delays += healthy.measure(now_s, min(now_s + 5.0, end_s)).delays_s
                peak = max(peak, resident_mb(server.process.pid))
                kernel_peak = max(kernel_peak, tcp_buffers_mb())
            closed = deaf.closed_s()
        meanwhile = Seen(sorted(delays), Counter(), 0.0)
    when = f", {closed[0]:.1f} to {closed[-1]:.1f} s after they connected" if closed else ""
    lines = (
        f"{stuck} clients that never read, at {rate_hz:g} Hz for {seconds:g} s,",
        f"beside {healthy_clients} that do; client_timeout_s {timeout_s:g}:",
        f"- closed by the server: {len(closed)} of {stuck}{when}",
        f"- server's memory: {memory:.1f} MB before, {peak - memory:+.1f} MB at most",
        f"- TCP buffers, both ends: {kernel:.1f} MB before, {kernel_peak - kernel:+.1f} MB at most",
        f"- healthy clients' delay before: {before.delays()}",
        f"- healthy clients' delay meanwhile: {meanwhile.delays()}",
    )
    return "\n".join(lines)


DELTA = "/ws/state?delta=1"
LOADS = (
    *(Load(clients) for clients in (1, 50, 200, 500, 1_000)),
    Load(5_000, rate_hz=1.0, measure_s=10.0),
    Load(50, tags=1_000),
    Load(50, tags=1_000, path=DELTA),
    Load(10, tags=10_000),
    Load(50, tags=10_000, path=DELTA),
)
QUICK_LOADS = (
    Load(50, measure_s=4.0),
    Load(500, measure_s=4.0),
    Load(50, tags=1_000, path=DELTA, measure_s=4.0),
)


def as_row(cells: Sequence[str]) -> str:
    """Right-aligned under the headings, as a row of a Markdown table."""
    return f"| {' | '.join(c.rjust(len(h)) for c, h in zip(cells, HEADINGS, strict=True))} |"


def main() -> None:
    use_own()
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="a minute instead of five")
    parser.add_argument("--only", type=int, metavar="N", help="row N of the table alone, from 0")
    parser.add_argument("--stuck", action="store_true", help="the stuck clients alone")
    options = parser.parse_args()
    loads = QUICK_LOADS if options.quick else LOADS
    if options.only is not None:
        loads = loads[options.only : options.only + 1]
    if not options.stuck:
        print(as_row(HEADINGS))
        print(f"|{'|'.join('-' * (len(h) + 1) + ':' for h in HEADINGS)}|")
        for started_with, same in itertools.groupby(loads, lambda load: load.server):
            with serving(*started_with) as server:
                for load in same:
                    print(as_row(measure_load(server, load)), flush=True)
    if options.only is None:
        print()
        if options.quick:
            print(measure_stuck(20, 10.0, 3.0))
        else:
            print(measure_stuck(20, 60.0, 30.0), measure_outages(), sep="\n\n")


if __name__ == "__main__":
    main()
