"""How many browsers three replicas of the fleet's page serve, at a scan a second of one site.

All is real: a journal that a plain program writes, its forwarder, PostgreSQL, three `lupin-twin
fleet`, and browsers in further processes, which share this machine. They follow the site's page, a
third of them each replica. The delay is from before the record in the journal until a browser has
read the frame.
"""

import os
import tempfile
import threading
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path
from urllib.parse import urlsplit

from lupin_twin.core.state import Write
from tests.bench.live_parts import Clients, Seen
from tests.support.archive import Archive, forwarder
from tests.support.fleet import fleet, write
from tests.support.journal import SECOND, pin, scan
from tests.support.postgres import server
from tests.support.proc_stat import cpu_s, resident_mb

REPLICAS, TAGS, MEASURED_S = 3, 30, 10.0
COUNTS = (300, 1_500, 3_000, 6_000)


def record(journal: Path, ending: threading.Event) -> None:
    """Scan a tag once a second, with the moment of the monotonic clock as a reading."""
    while not ending.wait(1.0):
        beat = time.monotonic()
        write(journal, [scan("0", time.time_ns(), beat=beat)])


def measure(ports: Sequence[int], pids: Sequence[int], count: int) -> None:
    """Print the figures of that many browsers."""
    share = count // REPLICAS
    with ExitStack() as stack:
        groups = [
            stack.enter_context(Clients(port, share, "/sites/gh0/ws/state?delta=1"))
            for port in ports
        ]
        joined_s = max(group.joined_s() for group in groups)
        start_s = time.monotonic() + 1.0
        time.sleep(1.0)
        before_s = [cpu_s(pid) for pid in pids]
        window = start_s, start_s + MEASURED_S
        with ThreadPoolExecutor(REPLICAS) as together:
            seen = list(together.map(lambda group: group.measure(*window), groups))
        took_s = time.monotonic() - start_s
        cores = [(cpu_s(pid) - was) / took_s for pid, was in zip(pids, before_s, strict=True)]
        memory = [resident_mb(pid) for pid in pids]
    delays = sorted(delay for each in seen for delay in each.delays_s)
    every = Seen(delays, seen[0].received, seen[0].frame_bytes)
    delivered = min(each.delivered(share) for each in seen)
    print(
        f"{count:>9,}{100 * delivered:>12.1f}{every.delay_ms(0.5):>11.0f}"
        f"{every.delay_ms(0.99):>9.0f}{joined_s:>10.1f}{max(cores):>16.2f}{max(memory):>12.0f}"
        f"{os.getloadavg()[0]:>8.0f}",
        flush=True,
    )


def main() -> None:
    print(
        " browsers  delivered %  median ms   p99 ms  joined s  cores a replica  MB a replica  load"
    )
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        archive = Archive(stack.enter_context(server(fsync=True)), "gh0")
        archive.add_user("page", "lupin_page")
        journal, now_ns = folder / "gh0", time.time_ns()
        rows: list[Write] = [
            pin(str(tag), now_ns - 600 * SECOND, float(tag)) for tag in range(TAGS)
        ]
        rows += [
            scan(str(tag), now_ns - SECOND, temperature=20.0, humidity=50.0, co2=410.0, light=300.0)
            for tag in range(TAGS)
        ]
        write(journal, rows)
        stack.enter_context(forwarder(archive, journal))
        pages = [
            stack.enter_context(fleet(archive, "--max-clients", "8000")) for _ in range(REPLICAS)
        ]
        for page in pages:
            page.site("gh0", is_live=True)
            assert page.http.get("/sites/gh0/api/state").status_code == 200
        ending = threading.Event()
        recording = threading.Thread(target=record, args=(journal, ending))
        recording.start()
        stack.callback(recording.join)
        stack.callback(ending.set)
        ports = [urlsplit(page.url).port or 0 for page in pages]
        for count in COUNTS:
            measure(ports, [page.process.pid for page in pages], count)
