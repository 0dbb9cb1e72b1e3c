"""Parameters as ROS hands them over; real nodes, in this process."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
import rclpy
from builtin_interfaces.msg import Time
from rclpy.context import Context
from rclpy.parameter import Parameter

from lupin_twin.parameters import ParameterError, TwinParameters
from lupin_twin.ros_parameters import declare, naming, naming_own_parameters, unknown_overrides


@contextmanager
def node_with(domain: int, *overrides: str) -> Iterator[Any]:
    context = Context()
    arguments = [word for override in overrides for word in ("-p", override)]
    rclpy.init(args=["--ros-args", *arguments], context=context, domain_id=domain)
    try:
        node = rclpy.create_node("any", context=context)
        yield node
        node.destroy_node()
    finally:
        rclpy.try_shutdown(context=context)


def test_all_are_declared_and_what_is_set_is_read(domain: int) -> None:
    with node_with(domain, "idw_power:=3", "state_topic:=/s") as node:
        assert declare(node) == TwinParameters(idw_power=3.0, state_topic="/s")
        assert node.describe_parameter("idw_power").additional_constraints == "0.01 to 100.0"


def test_some_are_declared_and_the_others_are_neither_read_nor_unknown(domain: int) -> None:
    with node_with(domain, "idw_power:=3.0", "buffer_len:=5") as node:
        assert declare(node, ["buffer_len"]) == TwinParameters(buffer_len=5)
        assert not node.has_parameter("idw_power")
        assert unknown_overrides(node) == []


def test_they_cannot_be_changed_while_the_node_runs(domain: int) -> None:
    with node_with(domain) as node:
        declare(node)
        for name, default in ((n, node.get_parameter(n)) for n in ("idw_power", "frame_id")):
            [result] = node.set_parameters([Parameter(name, value=default.value)])
            assert not result.successful
            assert "read-only" in result.reason


def test_an_override_of_no_parameter_is_known_by_name(domain: int) -> None:
    with node_with(domain, "idw_pwoer:=3.0", "use_sim_time:=false") as node:
        declare(node)
        assert unknown_overrides(node) == ["idw_pwoer"]


def test_what_another_node_of_the_twins_reads_has_to_be_right_too(domain: int) -> None:
    with (
        node_with(domain, "idw_power:=abc") as node,
        pytest.raises(ParameterError, match="parameter idw_power is 'abc'"),
    ):
        declare(node, ["buffer_len"])


def test_complaints_name_the_parameter(domain: int) -> None:
    with (
        node_with(domain) as node,
        pytest.raises(ParameterError, match="parameter map_topic is 'a b': Invalid topic name"),
        naming("map_topic", "a b"),
    ):
        node.create_subscription(Time, "a b", lambda _: None, 1)
    with (
        pytest.raises(ParameterError, match=r"parameter use_sim_time is no bool: .*'5'"),
        naming_own_parameters(),
        node_with(domain, "use_sim_time:=5"),
    ):
        pass
    with (
        pytest.raises(ParameterError, match="parameter start_type_description_service is no bool"),
        naming_own_parameters(),
        node_with(domain, "start_type_description_service:=5"),
    ):
        pass
