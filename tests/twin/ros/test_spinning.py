"""Spinning survives a callback that raises, and ends when ROS does; in this process."""

import threading
from collections.abc import Iterator
from typing import Any

import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor

from lupin_twin.ros.base_node import end_spinning, spin_until_shutdown
from tests.support.ros import node_in
from tests.support.waiting import wait_for


class Spinning:
    """A node whose timer runs `work`, spun in a thread."""

    def __init__(self, node: Any) -> None:
        self.node = node
        self.executor = SingleThreadedExecutor(context=node.context)
        self.executor.add_node(self.node)
        self.errors: list[tuple[str, Exception]] = []
        self.thread = threading.Thread(target=spin_until_shutdown, args=(self.executor, self.note))

    def note(self, what: str, error: Exception) -> None:
        self.errors.append((what, error))

    def has_ended(self) -> bool:
        return not self.thread.is_alive()


@pytest.fixture
def spinning(domain: int) -> Iterator[Spinning]:
    with node_in(domain, lambda it: rclpy.create_node("spinning", context=it)) as node:
        it = Spinning(node)
        yield it
        if not it.has_ended():
            end_spinning(it.executor)
        it.thread.join(5)


def test_the_shutdown_breaks_no_spin_that_is_about_to_wait(
    spinning: Spinning, monkeypatch: pytest.MonkeyPatch
) -> None:
    """rclpy's own shutdown, called from here at that moment, breaks the spin."""
    about_to_wait, requested = threading.Event(), threading.Event()
    get_nodes = spinning.executor.get_nodes

    def pause() -> Any:
        if threading.current_thread() is spinning.thread and not requested.is_set():
            about_to_wait.set()
            requested.wait(20)
        return get_nodes()

    monkeypatch.setattr(spinning.executor, "get_nodes", pause)
    spinning.thread.start()
    assert about_to_wait.wait(20)
    end_spinning(spinning.executor)
    requested.set()
    wait_for(spinning.has_ended, "the end of the spinning")
    assert spinning.errors == []


def test_a_callback_ends_before_the_spinning_does(spinning: Spinning) -> None:
    runs, requested, ended = threading.Event(), threading.Event(), threading.Event()

    def work() -> None:
        runs.set()
        requested.wait(20)
        ended.set()

    spinning.node.create_timer(0.01, work)
    spinning.thread.start()
    assert runs.wait(20)
    end_spinning(spinning.executor)
    requested.set()
    wait_for(spinning.has_ended, "the end of the spinning")
    assert ended.is_set()
    assert spinning.errors == []
