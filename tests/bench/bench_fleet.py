"""The archive of a fleet: lag of many forwarders, a state as of a moment, and how it grows.

Lag: from the arrival of a scan at its twin until the archive has committed it. Journals, forwarders
and PostgreSQL (fsync on) share this machine; forwarders are threads of a few processes, which run
the code of `lupin-twin forward`. Growth: rows of a site as it is forwarded, five sensors, a scan of
each of 30 tags every two minutes; further sites have the same.
"""

import json
import random
import sqlite3
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import psycopg

from lupin_bridge.archive.forwarding import Forwarder, Sink
from lupin_bridge.archive.journal_reader import Batch, Epoch
from lupin_twin.journal.fold import state_at
from lupin_twin.journal.runs import Clock
from lupin_twin.journal.schema import SiteLog
from tests.bench.journal_double import BEGUN_NS, Greenhouse, filled
from tests.support.archive import Archive, forward_once
from tests.support.journal import SECOND, append, scan
from tests.support.postgres import server

TAGS, PROCESSES = 30, 2
SENSORS = ("temperature", "humidity", "co2", "light", "moisture")
# What comes before does not count: 200 connections, and journals that have just started.
WARM_S, MEASURED_S = 15.0, 20.0
HOUR = 3_600 * SECOND
DAY = Greenhouse(tags=TAGS, days=1.0, every_s=120.0, inspection_days=0.0, failing=0)
# Of all tables, with their indexes, bytes.
SIZE = (
    "SELECT sum(pg_total_relation_size(oid)) FROM pg_class WHERE relkind = 'r'"
    " AND relnamespace = 'public'::regnamespace"
)


class _TimedSink(Sink):
    """The sink, which records for each scan how long after its arrival it is committed."""

    lags: list[tuple[float, float]] = []  # noqa: RUF012  # one for all

    def put(self, batch: Batch, epoch: Epoch) -> Epoch:
        put = super().put(batch, epoch)
        now_ns = time.time_ns()
        lags = [(now_ns / 1e9, (now_ns - row[5]) / 1e9) for row in batch.rows.get("scan", ())]
        self.lags.extend(lags)
        return put


def forward(folder: Path, urls: Sequence[str]) -> None:
    """Forward the journals of a folder until the input ends; then print moments and lags, s."""
    from lupin_bridge.archive import forwarding

    setattr(forwarding, "Sink", _TimedSink)  # noqa: B010
    for url in urls:
        site = url.partition("//")[2].partition("@")[0]
        forwarder = Forwarder(url, site, lambda site=site: folder / site, lambda line: None)  # type: ignore[misc]
        threading.Thread(target=forwarder.run, daemon=True).start()
    sys.stdin.read()
    json.dump(list(_TimedSink.lags), sys.stdout)


class _Twin:
    """A journal that receives a scan of each tag at once, with less work than in a twin.

    Its hours stay as the first scans left them; they are forwarded with each scan nevertheless.
    """

    def __init__(self, path: Path) -> None:
        now_ns = time.time_ns()
        values = dict.fromkeys(SENSORS, 20.0)
        rows = [
            scan(str(tag), now_ns - 1000 + tag, source="robot", **values) for tag in range(TAGS)
        ]
        append(path, rows, Clock(now_ns, now_ns, is_simulated=False))
        self._connection = sqlite3.connect(path, isolation_level=None)
        self._connection.execute("PRAGMA synchronous = OFF")
        self._series = [row[0] for row in self._connection.execute("SELECT series FROM series")]
        (self._seq,) = self._connection.execute("SELECT max(seq) FROM scan").fetchone()

    def record(self) -> None:
        now_ns = time.time_ns()
        self._connection.execute("BEGIN")
        self._connection.executemany(
            "INSERT INTO scan VALUES ('local', ?, ?, ?, NULL, ?, 0, 'robot', 'm1', '', 0,"
            " '[21.52,55.1,410.0,300.5,42.21]')",
            [
                (self._seq + n, series, now_ns - 1000, now_ns)
                for n, series in enumerate(self._series, 1)
            ],
        )
        self._connection.execute("COMMIT")
        self._seq += TAGS


def record(twins: Sequence[_Twin], seconds: float) -> float:
    """Let each record once a second, one after the other; returns how late the last was, s."""
    begun_s, number = time.time(), 0
    while (at_s := number / len(twins)) < seconds:
        time.sleep(max(0.0, begun_s + at_s - time.time()))
        twins[number % len(twins)].record()
        number += 1
    return time.time() - begun_s - seconds


def lag(sites: int) -> None:
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        archive = Archive(stack.enter_context(server(fsync=True, connections=sites + 20)), "gh0")
        names = [f"gh{number}" for number in range(sites)]
        for name in names:
            archive.add_user(name)
        twins = [_Twin(folder / name) for name in names]
        processes = []
        for n in range(PROCESSES):
            urls = [archive.url(name) for name in names[n::PROCESSES]]
            words = [sys.executable, "-m", "tests.bench.bench_fleet", str(folder), *urls]
            processes.append(
                stack.enter_context(
                    subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
                )
            )
        late_s = record(twins, WARM_S + MEASURED_S)
        ended_s = time.time()
        time.sleep(3.0)
        found = [lag for process in processes for lag in json.loads(process.communicate()[0])]
        lags = sorted(lag for at_s, lag in found if at_s > ended_s - MEASURED_S)
    print(
        f"{sites} sites x {TAGS} tags, a scan a second each, {MEASURED_S:.0f} s: {len(lags):,} of"
        f" {int(sites * TAGS * MEASURED_S):,} scans; lag p50 {lags[len(lags) // 2]:.2f} s,"
        f" p99 {lags[len(lags) * 99 // 100]:.2f} s, most {lags[-1]:.2f} s; the twins {late_s:.1f} s"
        " late",
        flush=True,
    )


def measure(archive: Archive, sites: int, days: int) -> None:
    """Print rows, bytes, and how long queries take."""
    chance, end_ns = random.Random(7), replace(DAY, days=float(days)).end_ns
    with psycopg.connect(archive.owner, autocommit=True) as connection:
        connection.execute("VACUUM ANALYZE")
        ((size,),) = connection.execute(SIZE).fetchall()
        states = []
        for _ in range(40):
            log = SiteLog(connection, f"gh{chance.randrange(sites)}")
            at_ns = BEGUN_NS + HOUR + int(chance.random() * (end_ns - BEGUN_NS - 2 * HOUR))
            start = time.perf_counter()
            found = state_at(log, at_ns, "map")  # type: ignore[arg-type]  # queries are of both
            states.append((time.perf_counter() - start) * 1e3)
            assert len(found.tags) == TAGS, len(found.tags)
    rows = sites * days * DAY.scans * TAGS
    print(
        f"{sites:>5}{days:>6}{rows:>12,}{float(size) / 1e6:>9.0f}{float(size) / rows:>8.0f}"
        f"{min(states):>13.1f}{statistics.median(states):>9.1f}",
        flush=True,
    )


def growth() -> None:
    """Print how the archive grows with days and with sites."""
    print(
        "sites  days       scans       MB  B/scan  state ms: least, median",
        flush=True,
    )
    with server(fsync=True) as postgresql:
        for days in (1, 10, 100):
            archive = Archive(postgresql, "gh0")
            forward_once(archive, filled(replace(DAY, days=float(days))).path)
            measure(archive, 1, days)
            archive.drop()
        archive, done = Archive(postgresql, "gh0"), 1
        forward_once(archive, filled(DAY).path)
        for sites in (10, 100):
            archive.copy_site(*(f"gh{number}" for number in range(done, sites)))
            measure(archive, sites, 1)
            done = sites


def week() -> None:
    """Print how long a week of a site that was offline takes, a process's start included."""
    journal = filled(replace(DAY, days=7.0))
    with server(fsync=True) as postgresql:
        archive = Archive(postgresql)
        begun_s = time.monotonic()
        forward_once(archive, journal.path)
        took_s = time.monotonic() - begun_s
        ((size,),) = archive.select(SIZE)
    rate, share = journal.readings / took_s, float(size) / (7 * DAY.scans * TAGS)
    print(f"a week: {journal.readings:,} readings, {rate:,.0f} a second, {share:.0f} B/scan")


def main() -> None:
    week()
    lag(200)
    growth()


if __name__ == "__main__":  # in a process of its own
    forward(Path(sys.argv[1]), sys.argv[2:])
