"""The table of topics and services matches the ROS graph of the nodes, with QoS."""

import runpy
from collections.abc import Iterator
from typing import Any
from xml.etree import ElementTree

import pytest
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy

from lupin_bridge.feed.web_node import WebNode
from lupin_twin.core import interfaces
from lupin_twin.ros.node import TwinNode
from tests.support.docs import DOCS
from tests.support.domains import own_domain
from tests.support.ros import node_in

LAYERS = ["temperature", "co2"]
# What rclpy gives to every node.
OF_ROS = {"/rosout", "/parameter_events"}
Node = TwinNode | WebNode


@pytest.fixture(scope="module")
def nodes() -> Iterator[dict[str, Node]]:
    """A twin with layers, and a `web`, as each one starts."""
    arguments = ["--ros-args", "-p", f"layers:=[{','.join(LAYERS)}]", "-p", "journal:='off'"]
    with (
        own_domain() as domain,
        node_in(domain, lambda it: TwinNode(context=it), *arguments) as twin,
        node_in(domain, lambda it: WebNode(lambda _: None, context=it), *arguments) as web,
    ):
        yield {twin.get_name(): twin, web.get_name(): web}


def own(found: list[tuple[str, list[str]]]) -> dict[str, str]:
    """Names and types, without those of every node."""
    return {
        name: kind
        for name, [kind] in found
        if name not in OF_ROS and name.rpartition("/")[2] not in interfaces.OF_EVERY_NODE
    }


def reported(those: Any) -> dict[str, str]:
    return {
        f"/{it.name.lstrip('/')}".replace("<sensor>", sensor): it.type_name
        for it in those
        for sensor in (LAYERS if "<sensor>" in it.name else [""])
    }


def by(node: Node, of: str) -> dict[str, str]:
    look = getattr(node, f"get_{of}_names_and_types_by_node")
    return own(look(node.get_name(), node.get_namespace()))


def test_a_twin_has_the_topics_and_services_of_the_table_and_no_others(
    nodes: dict[str, Node],
) -> None:
    twin = nodes["lupin_twin"]
    assert by(twin, "publisher") == reported(interfaces.PUBLISHED)
    # Only with simulated time is there a clock subscription.
    expected = [it for it in interfaces.SUBSCRIBED if it is not interfaces.CLOCK]
    assert by(twin, "subscriber") == reported(expected)
    assert by(twin, "service") == reported(interfaces.SERVICES)


def test_qos_is_that_of_the_table(nodes: dict[str, Node]) -> None:
    twin = nodes["lupin_twin"]
    for those, look in (
        (interfaces.PUBLISHED, twin.get_publishers_info_by_topic),
        (interfaces.SUBSCRIBED[:-1], twin.get_subscriptions_info_by_topic),
    ):
        for topic in those:
            for name in reported([topic]):
                [offered] = [i.qos_profile for i in look(name) if i.node_name == "lupin_twin"]
                assert (offered.durability == DurabilityPolicy.TRANSIENT_LOCAL) == topic.is_latched
                assert (offered.reliability == ReliabilityPolicy.RELIABLE) == topic.is_reliable


def test_every_service_of_every_node_is_in_the_table(nodes: dict[str, Node]) -> None:
    for node in nodes.values():
        services = node.get_service_names_and_types_by_node(node.get_name(), "/")
        below = {name.rpartition("/")[2] for name, _ in services if f"/{node.get_name()}/" in name}
        assert below == set(interfaces.OF_EVERY_NODE)


def test_the_policy_allows_everything_that_the_nodes_have(nodes: dict[str, Node]) -> None:
    root = ElementTree.fromstring(runpy.run_path(str(DOCS / "generate.py"))["policy"]())
    for node in nodes.values():
        [profile] = [it for it in root.iter("profile") if it.get("node") == node.get_name()]

        def allowed(tag: str, right: str, profile: Any = profile) -> set[str]:
            lists = [it for it in profile.iter(tag) if it.get(right) == "ALLOW"]
            return {(name.text or "") for one in lists for name in one}

        at = node.get_name(), node.get_namespace()
        for tag, right, found in (
            ("topics", "publish", node.get_publisher_names_and_types_by_node(*at)),
            ("topics", "subscribe", node.get_subscriber_names_and_types_by_node(*at)),
            ("services", "reply", node.get_service_names_and_types_by_node(*at)),
            ("services", "request", node.get_client_names_and_types_by_node(*at)),
        ):
            names = {name.replace(f"/{node.get_name()}/", "~/") for name, _ in found}
            names = {"/twin/field/*" if "/twin/field/" in name else name for name in names}
            assert names <= allowed(tag, right), (node.get_name(), right)
