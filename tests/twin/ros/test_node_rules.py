"""The node from inside: what no message over DDS would show. In this process."""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import pytest
import rclpy
from lupin_msgs.msg import TwinState
from rclpy.context import Context
from rclpy.parameter import Parameter

from lupin_twin.ros.node import TwinNode
from tests.support.messages import scan
from tests.support.ros import Peer


class Stage:
    """A node that nobody spins, and its warnings."""

    def __init__(self, node: TwinNode) -> None:
        self.node = node
        self.warnings: list[str] = []
        node.utilities.warn = lambda key, text: self.warnings.append(text)  # type: ignore[method-assign]

    def subscription(self, topic: str) -> Any:
        [found] = [s for s in self.node.subscriptions if s.topic_name == topic]
        return found


@contextmanager
def stage_in(domain: int, *ros_args: str) -> Iterator[Stage]:
    context = Context()
    rclpy.init(args=["--ros-args", *ros_args], context=context, domain_id=domain)
    try:
        node = TwinNode(context=context)
        yield Stage(node)
        node.destroy_node()
    finally:
        rclpy.try_shutdown(context=context)


@pytest.fixture
def stage(domain: int) -> Iterator[Stage]:
    with stage_in(domain) as made:
        yield made


# --- the contract -------------------------------------------------------------------------------


def test_a_changed_rule_takes_effect_at_once(stage: Stage) -> None:
    node = stage.node
    reported: list[Any] = []
    node.listen(reported.append, heartbeat_s=60.0)
    before, revision = node.rules, node.revision
    [result] = node.set_parameters([Parameter("idw_power", value=3.5)])
    assert (result.successful, result.reason) == (True, "")
    assert node.rules == replace(before, idw_power=3.5)
    assert node.revision != revision
    assert len(reported) == 2


# --- names --------------------------------------------------------------------------------------


def test_a_second_twin_is_counted_by_the_real_name_of_the_topic(domain: int) -> None:
    remapped = [
        *("-r", "/twin/state:=/r1/state"),
        *("-r", "/floranova/observations:=/r1/observations"),
    ]
    with stage_in(domain, *remapped) as stage, Peer(domain) as other:
        node = stage.node
        other.publisher("/r1/state", TwinState, depth=1)
        other.until(lambda: node.count_publishers("/r1/state") == 2, "both publishers")
        node.twins.see(2, -math.inf)  # for long
        node._publish_state()
        assert node.twins.value == 2
        assert "2 nodes publish /r1/state" in stage.warnings[0]
        node._on_observation(scan("", {}))
        assert "dropped an entry on /r1/observations" in stage.warnings[1]
