"""Alarms of a large greenhouse: the start over its past, and one change.

Processor time, so that other load does not count. Beside that, what the simulator's ordinary
days raise.
"""

import os
import statistics
import time
from collections import Counter
from collections.abc import Iterable, Iterator
from random import Random

from lupin_bridge.alarms.feed import LOT
from lupin_bridge.judge.alarm_fold import REACH_COUNT, AlarmFold
from lupin_twin.core.past import RunSpan
from lupin_twin.core.state import Observation
from tests.support.climate import DAY_NS, S, ordinary_days
from tests.support.proc_stat import resident_mb
from tests.support.seen import BY_LIGHT
from tests.support.store import logged

DAYS = 7
SIZES = (1_000, 10_000)
SPANS = (RunSpan(1, 0, 2**63 - 1),)
MIDDLE = {
    "temperature": 22.0,
    "humidity": 62.0,
    "co2": 600.0,
    "light": 900.0,
    "soil_moisture": 40.0,
}
CHANGES = 40


def past_of(tags: int) -> Iterator[Observation]:
    """Rounds of all tags, as many as are read at a start; one reading in a hundred is far out."""
    chance = Random(11)
    rounds = REACH_COUNT // tags
    step_ns = DAYS * DAY_NS // (rounds * tags)
    for number in range(rounds * tags):
        values = [middle * chance.uniform(0.95, 1.05) for middle in MIDDLE.values()]
        values[0] += 20.0 * (chance.random() < 0.01)
        yield write(number + 1, str(number % tags), number * step_ns, values)


def write(number: int, tag_id: str, at_ns: int, values: list[float]) -> Observation:
    return logged(number, 1, tag_id, at_ns, 0, 0, tuple(MIDDLE), tuple(values))


def ms_since(start: float) -> float:
    return (time.thread_time() - start) * 1e3


def alarms_of(tags: int) -> None:
    received = list(past_of(tags))
    before_mb = resident_mb(os.getpid())
    fold = AlarmFold(BY_LIGHT, SPANS)
    lots = []
    for first in range(0, len(received), LOT):
        start = time.thread_time()
        fold.take(received[first : first + LOT])
        lots.append(ms_since(start))
    now_ns = received[-1].stamp_ns
    start = time.thread_time()
    found = fold.found(now_ns)
    row(tags, f"start: {len(received):,} scans", sum(lots) + ms_since(start), max(lots))
    row(tags, f"start: all {len(found.alarms):,} alarms reported", ms_since(start))
    took_mb = resident_mb(os.getpid()) - before_mb
    print(f"{'':>7}  memory of that, without the scans received: {took_mb:.0f} MB")

    def changed(name: str, writes: Iterable[Observation], now_ns: int) -> None:
        took = []
        for one in writes:
            start = time.thread_time()
            fold.take([one])
            fold.found(max(now_ns, one.stamp_ns))
            took.append(ms_since(start))
        row(tags, name, statistics.median(took), max(took))

    numbers, values = range(1, CHANGES + 1), [*MIDDLE.values()]
    news = [write(len(received) + n, str(n), now_ns + n * S, values) for n in numbers]
    changed("alarms: one scan", news, now_ns)
    late = [
        write(2 * len(received) + n, str(n), now_ns - n * (now_ns // 100), values) for n in numbers
    ]
    changed("alarms: one scan, hours to days late", late, news[-1].stamp_ns)


def row(tags: int, name: str, took_ms: float, most_ms: float | None = None) -> None:
    most = "" if most_ms is None else f"{most_ms:>12.2f}"
    print(f"{tags:>7}  {name:<44}{took_ms:>12.2f}{most}")


def ordinary() -> None:
    received = ordinary_days()
    fold = AlarmFold(BY_LIGHT, SPANS)
    fold.take(received)
    raised = fold.found(received[-1].stamp_ns).alarms
    spells = (received[-1].stamp_ns - received[0].stamp_ns) / (600 * S)
    kinds = Counter(alarm.reason.kind.value for alarm in raised)
    reported = ", ".join(f"{kind} {count}" for kind, count in kinds.most_common())
    print(
        f"\nThe simulator's ordinary days: {len(raised)} alarms in {spells / 144:.1f} days, "
        f"{len(raised) / spells:.2f} in ten minutes ({reported})"
    )


def main() -> None:
    print(f"\n{'tags':>7}  {'five sensors each':<44}{'ms':>12}{'at most':>12}")
    for tags in SIZES:
        alarms_of(tags)
    ordinary()
