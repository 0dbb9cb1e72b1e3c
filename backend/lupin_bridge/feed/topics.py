"""What a twin's topics and service are called in ROS, and how its topics are to be heard. Pure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from lupin_twin.core import interfaces

# What is the largest that a twin itself takes in, see `lupin_twin.ros.message_limits`.
_LARGEST: Final = 64_000_000


def absolute(name: str) -> str:
    """A ROS name as seen from the root namespace: `a/b` is `/a/b`."""
    return name if name.startswith("/") else f"/{name}"


@dataclass(frozen=True, slots=True)
class TwinNames:
    """From the root on and after remapping; `field_layers` is what those of fields begin with."""

    state_topic: str
    field_service: str
    observations_topic: str = absolute(interfaces.OBSERVATIONS.name)
    discovered_tags_topic: str = absolute(interfaces.DISCOVERED_TAGS.name)
    map_topic: str = absolute(interfaces.MAP.name)
    diagnostics_topic: str = absolute(interfaces.DIAGNOSTICS.name)
    field_layers: str = absolute(interfaces.LAYERS_BELOW)
    tags_layer: str = absolute(interfaces.TAGS.name)
    planters_layer: str = absolute(interfaces.PLANTERS.name)


@dataclass(frozen=True, slots=True)
class Topic:
    """A topic and how it is to be heard.

    `name` is from the root on, `type_name` such as `lupin_msgs/msg/TwinState`. `latched`: reliable
    and transient local, so that the last ones come to who is late; otherwise as ROS has it by
    default. What is held of it are `depth` samples and `max_bytes` in all, at most.
    """

    name: str
    type_name: str
    latched: bool = True
    depth: int = 1
    max_bytes: int = _LARGEST


def topics_of(names: TwinNames) -> tuple[Topic, ...]:
    """A twin's state, what it listens to, and what it says of itself."""
    return (
        _received(names.state_topic, interfaces.STATE),
        _received(names.observations_topic, interfaces.OBSERVATIONS, 8_000_000),
        _received(names.discovered_tags_topic, interfaces.DISCOVERED_TAGS, 16_000_000),
        _received(names.map_topic, interfaces.MAP),
        _received(names.diagnostics_topic, interfaces.DIAGNOSTICS, 4_000_000),
    )


def _received(name: str, topic: interfaces.Topic, max_bytes: int = _LARGEST) -> Topic:
    return Topic(name, topic.type_name, topic.is_latched, topic.depth, max_bytes)
