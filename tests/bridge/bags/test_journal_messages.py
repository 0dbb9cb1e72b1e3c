from dataclasses import replace

from lupin_msgs.msg import DiscoveredTags, Observation
from rclpy.serialization import deserialize_message
from rosgraph_msgs.msg import Clock

from lupin_bridge.bags import journal_export as journal_messages
from lupin_twin.core import ingest
from lupin_twin.core.state import Inspection, Pin, Pose, Scan
from lupin_twin.ros import convert
from tests.support.journal import NOW, look, pin, scan

FAILED_LOOK = Inspection(
    "7", NOW, None, status=2, status_detail="dark", source="robot", mission="m1"
)


def written(row: Scan | Inspection) -> Scan | Inspection:
    """What the message makes a twin write that hears it later."""
    msg = deserialize_message(journal_messages.observation(row), Observation)
    write = ingest.observation(convert.received(msg), "map", NOW * 2)
    assert isinstance(write, Scan | Inspection)
    return write


def test_a_scan_is_heard_as_it_was() -> None:
    row = scan(temperature=21.5, light=float("inf"))
    expected = Scan("7", NOW, row.readings, source="robot", own_stamp_ns=NOW, mission="m1")
    assert written(row) == expected
    failed = replace(row, readings=(), status=1, status_detail="no way")
    assert written(failed) == replace(expected, readings=(), status=1, status_detail="no way")


def test_a_look_is_heard_as_it_was() -> None:
    row = look(anomaly=True)
    assert written(row) == Inspection(
        "7", NOW, row.flower, source="robot", own_stamp_ns=NOW, mission="m1"
    )
    assert written(FAILED_LOOK) == replace(FAILED_LOOK, own_stamp_ns=NOW)


def test_the_stamp_is_the_one_that_counted() -> None:
    assert written(replace(scan(), own_stamp_ns=NOW * 3)).stamp_ns == NOW


def test_places_are_discovered_again() -> None:
    half_turn = replace(pin("8"), pose=Pose(1.0, 2.0, 3.0, 0.0, 0.0, 1.0, 1e-9))
    data = journal_messages.discovered([replace(pin("7"), stamp_ns=NOW - 1), half_turn])
    assert convert.nanoseconds(deserialize_message(data, DiscoveredTags).header.stamp) == NOW
    heard = convert.received_tags(deserialize_message(data, DiscoveredTags))
    found = list(ingest.discoveries(heard, "", "map", lambda _: False))
    assert found == [Pin("7", pin().pose), Pin("8", half_turn.pose)]


def test_the_clock() -> None:
    msg = deserialize_message(journal_messages.clock(12_000_000_034), Clock)
    assert (msg.clock.sec, msg.clock.nanosec) == (12, 34)
