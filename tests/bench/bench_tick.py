"""The 1 Hz tick: the state and the times of a big greenhouse, few tags changed or all; its JSON."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import rclpy
from lupin_msgs.msg import TwinState, TwinTimes
from rclpy.context import Context

from lupin_bridge.stream.state_json import StateJson
from lupin_twin.core.state import Attempt, Flower, Pose, Reading, Snapshot, TagState
from lupin_twin.ros import convert
from lupin_twin.ros.base_node import latched
from tests.support.domains import own_domain

S = 1_000_000_000


def tags(count: int) -> tuple[TagState, ...]:
    return tuple(
        TagState(
            tag_id=str(i),
            pose=Pose(i * 0.1, 1.0, 0.3, 0.0, 0.0, 0.0, 1.0),
            readings=(
                Reading("temperature", 20.0 + i % 7, S + i),
                Reading("humidity", 60.0, S + i),
            ),
            last_observed_ns=S + i,
            flower=Flower("rose", 0.9, flower_count=3, footprint=((0.0, 0.0, 0.0),) * 4),
            looked_at_ns=S + i,
            last_try=Attempt(S + i),
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


def measure(count: int, state: Any, times: Any) -> None:
    states, parts, text = convert.StateMessages(), convert.TimesMessages(), StateJson()
    columns: list[list[float]] = [[] for _ in range(6)]
    now = tags(count)
    first = Snapshot(S, "map", now)
    for warm_up in (states.build, parts.build, text.state):
        warm_up(first)
    for turn in range(2, 12):
        now = few_changed(now, turn)
        snapshot = Snapshot(turn * S, "map", now)
        steps: tuple[Callable[[], object], ...] = (
            partial(convert.StateMessages().build, snapshot),
            partial(states.build, snapshot),
            lambda snapshot=snapshot: state.publish(states.build(snapshot)),  # type: ignore[misc]
            partial(parts.build, snapshot),
            lambda snapshot=snapshot: times.publish(parts.build(snapshot)),  # type: ignore[misc]
            partial(text.state, snapshot),
        )
        for column, step in zip(columns, steps, strict=True):
            column.append(timed_ms(step))
    rebuilt, build, publish, build_times, publish_times, json = map(statistics.median, columns)
    print(
        f"{count:>7}{rebuilt:>14.1f}{build:>14.1f}{build + publish:>12.1f}"
        f"{build_times + publish_times:>12.1f}{json:>8.1f}"
    )


def main() -> None:
    print(
        f"\n{'tags':>7}{'all rebuilt':>14}{'1 % changed':>14}{'state tick':>12}"
        f"{'times tick':>12}{'JSON':>8}  (ms)"
    )
    with own_domain() as domain:
        context = Context()
        rclpy.init(args=[], context=context, domain_id=domain)
        node = rclpy.create_node("bench_tick", context=context)
        state = node.create_publisher(TwinState, "/twin/state", latched(1))
        times = node.create_publisher(TwinTimes, "/twin/times", latched(1))
        for count in (30, 1_000, 10_000):
            measure(count, state, times)
        node.destroy_node()
        rclpy.try_shutdown(context=context)


if __name__ == "__main__":
    main()
