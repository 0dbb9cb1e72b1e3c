"""The 1 Hz tick: building and publishing the state of a big greenhouse, few tags changed or all."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import rclpy
from lupin_msgs.msg import TwinState
from rclpy.context import Context

from lupin_twin import convert
from lupin_twin.habits import latched
from lupin_twin.state import Flower, Pose, Reading, Snapshot, TagState
from tests.support.domains import own_domain

S = 1_000_000_000


def tags(count: int) -> tuple[TagState, ...]:
    return tuple(
        TagState(
            tag_id=str(i),
            pose=Pose(i * 0.1, 1.0, 0.3, 0.0, 0.0, 0.0, 1.0),
            readings=(Reading("temperature", 20.0 + i % 7), Reading("humidity", 60.0)),
            last_observed_ns=S,
            flower=Flower("rose", 0.9, flower_count=3, footprint=((0.0, 0.0, 0.0),) * 4),
        )
        for i in range(count)
    )


def few_changed(before: tuple[TagState, ...], turn: int) -> tuple[TagState, ...]:
    """The same tags, every hundredth of them observed once more."""
    return tuple(
        replace(tag, last_observed_ns=turn * S) if i % 100 == turn % 100 else tag
        for i, tag in enumerate(before)
    )


def timed_ms(run: Callable[[], object]) -> float:
    start = time.perf_counter()
    run()
    return (time.perf_counter() - start) * 1e3


def measure(count: int, publisher: Any) -> None:
    kept = convert.StateMessages()
    rebuilt, few, published = [], [], []
    now = tags(count)
    kept.build(Snapshot(S, "map", now))
    for turn in range(2, 12):
        now = few_changed(now, turn)
        snapshot = Snapshot(turn * S, "map", now)
        rebuilt.append(timed_ms(partial(convert.StateMessages().build, snapshot)))
        few.append(timed_ms(partial(kept.build, snapshot)))
        published.append(timed_ms(partial(publisher.publish, kept.build(snapshot))))
    build, publish = statistics.median(few), statistics.median(published)
    print(
        f"{count:>7}{statistics.median(rebuilt):>14.1f}{build:>14.1f}{publish:>10.1f}"
        f"{build + publish:>10.1f}"
    )


def main() -> None:
    print(f"\n{'tags':>7}{'all rebuilt':>14}{'1 % changed':>14}{'publish':>10}{'tick':>10}  (ms)")
    with own_domain() as domain:
        context = Context()
        rclpy.init(args=[], context=context, domain_id=domain)
        node = rclpy.create_node("bench_tick", context=context)
        publisher = node.create_publisher(TwinState, "/twin/state", latched(1))
        for count in (30, 1_000, 10_000):
            measure(count, publisher)
        node.destroy_node()
        rclpy.try_shutdown(context=context)


if __name__ == "__main__":
    main()
