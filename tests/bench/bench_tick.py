"""The 1 Hz tick: building and publishing the state of a big greenhouse, all tags and few changed."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import replace

import rclpy
from lupin_msgs.msg import TwinState
from lupin_twin import convert
from lupin_twin.node import latched
from lupin_twin.state import Flower, Pose, Reading, Snapshot, TagState
from rclpy.context import Context

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


def median_ms(run: Callable[[], object], times: int = 9) -> float:
    run()
    took = []
    for _ in range(times):
        start = time.perf_counter()
        run()
        took.append(time.perf_counter() - start)
    return statistics.median(took) * 1e3


def main() -> None:
    print(f"\n{'tags':>7}{'all rebuilt':>14}{'1 % changed':>14}{'publish':>10}{'tick':>10}  (ms)")
    with own_domain() as domain:
        context = Context()
        rclpy.init(args=[], context=context, domain_id=domain)
        node = rclpy.create_node("bench_tick", context=context)
        publisher = node.create_publisher(TwinState, "/twin/state", latched(1))
        for count in (30, 1_000, 10_000):
            before = tags(count)
            messages = convert.StateMessages()
            messages.build(Snapshot(2 * S, "map", before))
            ticks = iter(range(10**6))

            def few_changed(
                before: tuple[TagState, ...] = before, messages: convert.StateMessages = messages
            ) -> object:
                tick = next(ticks)  # noqa: B023  # used up within the loop's turn
                changed = {(tick + 100 * i) % len(before) for i in range(len(before) // 100 or 1)}
                now = tuple(
                    replace(tag, last_observed_ns=tick * S) if i in changed else tag
                    for i, tag in enumerate(before)
                )
                start = time.perf_counter()
                messages.build(Snapshot(tick * S, "map", now))
                spent.append(time.perf_counter() - start)  # noqa: B023
                return None

            spent: list[float] = []
            rebuilt = median_ms(
                lambda b=before: convert.StateMessages().build(Snapshot(2 * S, "map", b))  # type: ignore[misc]
            )
            for _ in range(10):
                few_changed()
            few = statistics.median(spent) * 1e3
            message = messages.build(Snapshot(3 * S, "map", before))
            publish = median_ms(lambda m=message: publisher.publish(m))  # type: ignore[misc]
            print(f"{count:>7}{rebuilt:>14.1f}{few:>14.1f}{publish:>10.1f}{few + publish:>10.1f}")
        node.destroy_node()
        rclpy.try_shutdown(context=context)


if __name__ == "__main__":
    main()
