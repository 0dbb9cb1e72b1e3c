"""The past over HTTP: every question for the first time, of a usual house and of the largest.

A real `lupin-twin serve` over a journal of a year (30 tags) and of a month (10,000 tags). Each
call asks for another moment, so nothing is kept; what an empty answer costs is in the figures.
The export (alone with `--export`) is read to its end; its memory is the server's and that of the
process that looks back for it.
"""

import random
import statistics
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import httpx

from tests.bench.journal_double import MONTH, QUICK_MONTH, QUICK_YEAR, SECOND, YEAR, House, filled
from tests.support.domains import own_domain
from tests.support.proc_stat import peak_mb, reset_peak, resident_mb
from tests.support.processes import limits, lupin_twin, url_of
from tests.support.state_home import use_own
from tests.support.waiting import wait_for

# The export's: more than ten million rows. 5,000 tags, whose readings come one in a message.
MANY = House(tags=5_000, days=28.0, every_s=6_000.0)
QUICK_MANY = House(tags=5_000, days=2.0, every_s=6_000.0)
UNBOUNDED = limits(answers_per_s=10_000, answer_timeout_s=60)
KEPT = ("-p", "journal_days:=36500.0", "-p", "journal_max_mb:=1000000.0")
FIELD = "sensor_type=co2&bbox_min_x=0&bbox_min_y=0&bbox_max_x=10&bbox_max_y=10&resolution=0.05"


@contextmanager
def remembering(house: House) -> Iterator[tuple[httpx.Client, int]]:
    """A client of a server with the journal of a house, and the server's process."""
    journal = filled(house).path
    with (
        own_domain() as domain,
        lupin_twin(
            domain, "serve", *UNBOUNDED, "--ros-args", *KEPT, "-p", f"journal:={journal}"
        ) as process,
        httpx.Client(base_url=url_of(process), timeout=600.0, trust_env=False) as client,
    ):
        wait_for(lambda: len(client.get("/api/state").json()["tags"]) == house.tags, "the tags")
        yield client, process.pid


def row(what: str, ask: Callable[[float], httpx.Response], house: House, times: int) -> None:
    """Time a question at so many moments."""
    chance = random.Random(7)
    begun_s = house.end_ns / SECOND - house.days * 86_400.0
    took, size = [], 0
    for _ in range(times + 3):
        at_s = begun_s + chance.uniform(0.1, 1.0) * house.days * 86_400.0
        start = time.perf_counter()
        answer = ask(round(at_s, 3))
        took.append(time.perf_counter() - start)
        assert answer.status_code in (200, 304), answer.text
        size = max(size, len(answer.content))
    took = sorted(took[3:])
    median, p95 = statistics.median(took), took[int(0.95 * len(took))]
    print(
        f"{what:<52}{median * 1e3:>9.1f} ms{p95 * 1e3:>9.1f} ms{size / 1e3:>10.0f} kB", flush=True
    )


def questions(house: House, times: int) -> None:
    """Every question but the export."""
    print(f"\n{f'{house.tags:,} tags, {house.days:g} days':<52}{'median':>12}{'p95':>12}")
    with remembering(house) as (client, _):

        def ask(path: str) -> Callable[[float], httpx.Response]:
            return lambda at_s: client.get(path.format(at=at_s))

        def unchanged(at_s: float) -> httpx.Response:
            path = f"/api/field.json?{FIELD}&at={at_s}"
            etag = client.get(path).headers["etag"]
            timed = time.perf_counter()
            answer = client.get(path, headers={"If-None-Match": etag})
            not_modified.append(time.perf_counter() - timed)
            return answer

        not_modified: list[float] = []
        row("state", ask("/api/state?at={at}"), house, times)
        row("one tag", ask("/api/tags/7?at={at}"), house, times)
        for kind in ("json", "npy", "png"):
            row(
                f"field 200 x 200, {kind}",
                ask(f"/api/field.{kind}?{FIELD}&at={{at}}"),
                house,
                times,
            )
        row("field and the same once more", unchanged, house, times)
        print(f"{'of it: the 304':<52}{statistics.median(not_modified) * 1e3:>9.1f} ms")
        row("quality", ask(f"/api/field/quality?{FIELD}&at={{at}}"), house, times)
        one = "/api/history?tag_id=7&sensor_type=co2"
        row("history of all the time, 500 buckets", ask(one), house, times)
        row("history up to then, 500 buckets", ask(f"{one}&to={{at}}"), house, times)
        row("timeline of all the time, 500 buckets", ask("/api/timeline"), house, min(times, 20))
        row("timeline up to then", ask("/api/timeline?to={at}"), house, min(times, 20))


def child_of(pid: int) -> int:
    """The one process that a server has started."""
    [child] = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    return int(child)


def export(house: House) -> None:
    """All rows, read to the end."""
    with remembering(house) as (client, server):
        client.get("/api/timeline").raise_for_status()  # who looks back is there from now on
        pids = {"server": server, "who looks back": child_of(server)}
        before_mb = {who: resident_mb(pid) for who, pid in pids.items()}
        for pid in pids.values():
            reset_peak(pid)
        start = time.perf_counter()
        lines = size = 0
        with client.stream("GET", "/api/export.csv") as answer:
            for piece in answer.iter_raw():
                lines += piece.count(b"\n")
                size += len(piece)
        took = time.perf_counter() - start
        print(
            f"\nexport: {lines - 1:,} rows, {size / 1e6:,.0f} MB in {took:.0f} s,"
            f" {(lines - 1) / took:,.0f} rows a second",
            flush=True,
        )
        for who, pid in pids.items():
            print(
                f"memory of {who}: {before_mb[who]:.0f} MB before, {peak_mb(pid):.0f} MB at most,"
                f" {resident_mb(pid):.0f} MB behind it",
                flush=True,
            )


def main(*, is_quick: bool = False, is_export: bool = False) -> None:
    """Print all of it, or of the export alone."""
    year, month = (QUICK_YEAR, QUICK_MONTH) if is_quick else (YEAR, MONTH)
    if not is_export:
        questions(year, 20 if is_quick else 100)
        questions(month, 10 if is_quick else 20)
    export(QUICK_MANY if is_quick else MANY)
    # The same with a reader in no hurry is the same memory: see the tests.
    export(replace(QUICK_YEAR, sets=5))


if __name__ == "__main__":
    use_own()
    main(is_quick="--quick" in sys.argv, is_export="--export" in sys.argv)
