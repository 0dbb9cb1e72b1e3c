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

import argparse
import itertools
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from tests.bench.live_parts import HEAD_START_S, Clients, Seen, Server, serving
from tests.support.proc_stat import cpu_s, resident_mb, tcp_buffers_mb
from tests.support.processes import limits
from tests.support.state_home import use_own

# Between joining, which is not measured, and what is: the load goes on meanwhile.
SETTLE_S = 1.0


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


def measure_load(server: Server, load: Load) -> list[str]:
    """One row of the table."""
    with Clients(server.port, load.clients, load.path) as clients:
        joined_s = clients.joined_s()
        start_s = time.monotonic() + SETTLE_S
        time.sleep(SETTLE_S)  # for every load as long: joining is not measured
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
        serving(30, rate_hz, *limits(client_timeout_s=timeout_s)) as server,
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
        f"beside {healthy_clients} that do; cut off after {timeout_s:g}:",
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
        seconds, timeout_s = (10.0, 3.0) if options.quick else (60.0, 30.0)
        print("", measure_stuck(20, seconds, timeout_s), sep="\n")


if __name__ == "__main__":
    main()
