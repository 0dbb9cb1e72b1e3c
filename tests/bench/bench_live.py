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
- cores: the processor time of the server and its child processes, over the time measured.
- past: the answers to requests for the past meanwhile, by status.
- memory: the resident memory of the same at the end, MB; a page that two share counts once.
"""

import itertools
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from threading import Event, Thread

import httpx

from tests.bench.journal_double import BEGUN_NS, SECOND, Greenhouse, filled
from tests.bench.live_parts import Clients, Server, serving

# Between joining, which is not measured, and the measurement: the load goes on meanwhile.
SETTLE_S = 1.0


@dataclass(frozen=True, slots=True)
class Load:
    """One row: that many clients of a twin with that many tags and that rate of scans.

    `frames_hz` 0: the bridge may send a frame for each scan. `days` is the age of the journal, and
    `asks` whether a client requests much of it, one answer after the other.
    """

    clients: int
    rate_hz: float = 10.0
    frames_hz: float = 0.0
    tags: int = 30
    path: str = "/ws/state"
    days: int = 0
    asks: bool = False
    measure_s: float = 8.0

    @property
    def server(self) -> tuple[int, float, float, int]:
        """How the server and the robot are started."""
        return self.tags, self.rate_hz, self.frames_hz, self.days


@contextmanager
def asking(port: int, days: int) -> Iterator[Counter[int]]:
    """A client that requests the past, as much as a page can, until the end of the context.

    Yields the number of its answers by status.
    """
    begin_s, is_over = BEGUN_NS // SECOND, Event()
    period = f"from={begin_s}&to={begin_s + days * 86_400}"
    answers = Counter[int]()

    def ask() -> None:
        with httpx.Client(base_url=f"http://127.0.0.1:{port}", trust_env=False) as http:
            for path in itertools.cycle(PAST):
                if is_over.is_set():
                    return
                answers[http.get(f"/api/{path}&{period}", timeout=60.0).status_code] += 1

    thread = Thread(target=ask)
    thread.start()
    try:
        yield answers
    finally:
        is_over.set()
        thread.join()


def measure_load(server: Server, load: Load) -> list[str]:
    past = asking(server.port, load.days) if load.asks else nullcontext(Counter[int]())
    with Clients(server.port, load.clients, load.path) as clients, past as answers:
        joined_s = clients.joined_s()
        start_s = time.monotonic() + SETTLE_S
        time.sleep(SETTLE_S)  # for every load the same time: joining is not measured
        before_s = server.cpu_s()
        # The clients answer when it is over and drained; the processor time ends with them.
        seen = clients.measure(start_s, start_s + load.measure_s)
        cores = (server.cpu_s() - before_s) / (time.monotonic() - start_s)
        memory = server.memory_mb()
    return [
        f"{load.tags:,}",
        f"{load.clients:,}",
        f"{load.rate_hz:g}",
        f"{load.frames_hz or load.rate_hz:g}",
        "delta" if "delta=1" in load.path else "full",
        f"{seen.frame_bytes / 1e3:,.1f}",
        f"{100 * seen.delivered(load.clients):.2f}",
        f"{seen.delay_ms(0.5):.1f}",
        f"{seen.delay_ms(0.99):.1f}",
        f"{joined_s:.2f}",
        f"{cores:.2f}",
        f"{memory:.0f}",
        " ".join(f"{count}x{status}" for status, count in answers.items()) or "-",
    ]


HEADINGS = (
    *("tags", "clients", "scans/s", "Hz", "frames", "kB", "delivered %", "median ms", "p99 ms"),
    *("joined s", "cores", "memory MB", "past"),
)


DELTA = "/ws/state?delta=1"
# All of the journal, in as many points as a request may have.
PAST = (
    *("history?tag_id=3&sensor_type=vpd&points=5000", "timeline?points=5000"),
    *("report?", "export.csv?tag_id=3"),
)
LOADS = (
    *(Load(clients) for clients in (1, 50, 200, 500, 1_000)),
    *(Load(200, rate_hz=40.0, frames_hz=10.0, path=path) for path in ("/ws/state", DELTA)),
    *(
        Load(200, rate_hz=40.0, frames_hz=10.0, path=DELTA, days=20, asks=asks, measure_s=20.0)
        for asks in (False, True)
    ),
    Load(5_000, rate_hz=1.0, measure_s=10.0),
    Load(50, tags=1_000),
    Load(50, tags=1_000, path=DELTA),
    Load(10, tags=10_000),
    Load(50, tags=10_000, path=DELTA),
)


def journal_of(greenhouse: Greenhouse) -> Sequence[str]:
    """Arguments of a server that goes on with a greenhouse's journal."""
    parameters = {"journal": filled(greenhouse).path, "journal_days": 3_650.0}
    return ("--ros-args", *itertools.chain(*(("-p", f"{n}:={v}") for n, v in parameters.items())))


def as_row(cells: Sequence[str]) -> str:
    """Right-aligned under the headings, as a row of a Markdown table."""
    return f"| {' | '.join(c.rjust(len(h)) for c, h in zip(cells, HEADINGS, strict=True))} |"


def main() -> None:
    print(as_row(HEADINGS))
    print(f"|{'|'.join('-' * (len(h) + 1) + ':' for h in HEADINGS)}|")
    for started, same in itertools.groupby(LOADS, lambda load: load.server):
        tags, rate_hz, frames_hz, days = started
        options = journal_of(Greenhouse(tags, days, every_s=600.0)) if days else ()
        with serving(tags, rate_hz, *options, frames_hz=frames_hz) as server:
            for load in same:
                print(as_row(measure_load(server, load)), flush=True)
