"""The live bridge under load: `make bench-live`.

A real `lupin-twin serve`, a robot in a process of its own that changes one tag at the row's rate
over DDS, and clients in further processes. All share this machine, so the clients' own work weighs
on the figures too. Rows of the same twin and rate share a server.

The columns:

- delay: from the robot's `publish()` until the client's process has read the frame that carries
  the change. In it are DDS, the twin, the bridge's pacing, serialisation, the fan-out, the kernel
  and the client's own queue. Both ends read CLOCK_MONOTONIC, which all processes share.
- delivered: the share of (frames made × clients) that arrived. A frame that a slow client
  skipped, as the bridge intends, counts as not delivered.
- joined: all clients connect in the same moment; the time until the last has its first state.
- cores: the server's processor time, all threads, over the time measured.
- memory: the server's resident memory at the end, MB.
"""

import itertools
import time
from collections.abc import Sequence
from dataclasses import dataclass

from tests.bench.live_parts import Clients, Server, serving
from tests.support.proc_stat import cpu_s, resident_mb

# Between joining, which is not measured, and the measurement: the load goes on meanwhile.
SETTLE_S = 1.0


@dataclass(frozen=True, slots=True)
class Load:
    """One row: that many clients of a twin with that many tags and that rate of changes."""

    clients: int
    rate_hz: float = 10.0
    tags: int = 30
    path: str = "/ws/state"
    measure_s: float = 8.0

    @property
    def server(self) -> tuple[int, float]:
        """How the server and the robot are started: tags and rate."""
        return self.tags, self.rate_hz


def measure_load(server: Server, load: Load) -> list[str]:
    """One row of the table."""
    with Clients(server.port, load.clients, load.path) as clients:
        joined_s = clients.joined_s()
        start_s = time.monotonic() + SETTLE_S
        time.sleep(SETTLE_S)  # for every load the same time: joining is not measured
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


DELTA = "/ws/state?delta=1"
LOADS = (
    *(Load(clients) for clients in (1, 50, 200, 500, 1_000)),
    Load(5_000, rate_hz=1.0, measure_s=10.0),
    Load(50, tags=1_000),
    Load(50, tags=1_000, path=DELTA),
    Load(10, tags=10_000),
    Load(50, tags=10_000, path=DELTA),
)


def as_row(cells: Sequence[str]) -> str:
    """Right-aligned under the headings, as a row of a Markdown table."""
    return f"| {' | '.join(c.rjust(len(h)) for c, h in zip(cells, HEADINGS, strict=True))} |"


def main() -> None:
    print(as_row(HEADINGS))
    print(f"|{'|'.join('-' * (len(h) + 1) + ':' for h in HEADINGS)}|")
    for started_with, same in itertools.groupby(LOADS, lambda load: load.server):
        with serving(*started_with) as server:
            for load in same:
                print(as_row(measure_load(server, load)), flush=True)
