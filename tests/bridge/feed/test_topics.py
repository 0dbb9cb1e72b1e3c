"""What is heard of a twin, and how: as the contracts of its topics have it."""

from __future__ import annotations

from lupin_bridge.feed.topics import TwinNames, topics_of


def test_a_twins_topics_are_heard_as_their_contracts_have_it() -> None:
    names = TwinNames("/n/twin/state", "/n/twin/get_field", "/n/o", "/n/d", "/n/map")
    topics = topics_of(names)
    assert {topic.name: (topic.type_name, topic.latched, topic.depth) for topic in topics} == {
        "/n/twin/state": ("lupin_msgs/msg/TwinState", True, 1),
        "/n/o": ("lupin_msgs/msg/Observation", True, 50),
        "/n/d": ("lupin_msgs/msg/DiscoveredTags", True, 50),
        "/n/map": ("nav_msgs/msg/OccupancyGrid", True, 1),
        "/diagnostics": ("diagnostic_msgs/msg/DiagnosticArray", False, 10),
    }
    assert all(0 < topic.max_bytes <= 64_000_000 for topic in topics)
