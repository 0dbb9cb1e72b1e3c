from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from lupin_msgs.msg import SensorReading, TagTimes, TwinState, TwinTagState, TwinTimes
from rclpy.serialization import deserialize_message, serialize_message

from lupin_bridge.feed.relay import schema_text
from tests.support.bags import by_mcap_ros2, by_rosbags, plain
from tests.support.messages import discovered, look, occupancy_grid, pose, scan
from tests.support.ros import clock_at

MESSAGES = {
    "lupin_msgs/msg/Observation": scan("a", {"temperature": 21.5, "co₂": float("nan")}, (1, 2)),
    "lupin_msgs/msg/DiscoveredTags": discovered({"a": pose(1, 2), "b": pose(w=0)}),
    "lupin_msgs/msg/TwinState": TwinState(
        tags=[TwinTagState(tag_id="a", readings=[SensorReading(name="light", value=2.0)])]
    ),
    "lupin_msgs/msg/TwinTimes": TwinTimes(tags=[TagTimes(tag_id="a", sensors=["light"])]),
    "nav_msgs/msg/OccupancyGrid": occupancy_grid([[0, 100], [-1, 50]]),
    "rosgraph_msgs/msg/Clock": clock_at(12.5),
    "diagnostic_msgs/msg/DiagnosticArray": DiagnosticArray(
        status=[DiagnosticStatus(name="twin", values=[KeyValue(key="k", value="v")])]
    ),
}
LOOK = look("a", "lupin", (1, 2), blooms=[(1, 2), (3, 4)], footprint=[(0, 0), (1, 0), (1, 1)])


@pytest.mark.parametrize("read", [by_mcap_ros2, by_rosbags])
@pytest.mark.parametrize(
    ("type_name", "message"), [*MESSAGES.items(), ("lupin_msgs/msg/Observation", LOOK)]
)
def test_who_has_only_the_text_reads_the_message(
    read: Callable[[str, str, bytes], Any], type_name: str, message: Any
) -> None:
    data = serialize_message(message)
    found = read(type_name, schema_text(type_name), data)
    assert plain(found) == plain(deserialize_message(data, type(message)))


def test_each_part_is_there_once_below_its_name() -> None:
    text = schema_text("lupin_msgs/msg/TwinState")
    heads = [line for line in text.splitlines() if line.startswith("MSG: ")]
    names = (
        "builtin_interfaces/Time geometry_msgs/Point geometry_msgs/Point32 geometry_msgs/Polygon "
        "geometry_msgs/Pose geometry_msgs/Quaternion lupin_msgs/FlowerPoint "
        "lupin_msgs/SensorReading lupin_msgs/TwinTagState std_msgs/Header"
    )
    assert sorted(heads) == [f"MSG: {name}" for name in names.split()]


def package(prefix: Path, name: str, **messages: str) -> None:
    folder = prefix / "share" / name / "msg"
    folder.mkdir(parents=True)
    for message, text in messages.items():
        (folder / f"{message}.msg").write_text(text, encoding="utf-8")


def test_the_prefixes_of_a_sourced_ros_come_first(tmp_path: Path) -> None:
    package(tmp_path / "overlay", "here_msgs", One="Two[<=3] twos  # of them\nuint8 X=1\n")
    package(tmp_path / "overlay", "std_msgs", Header="string<=5 mine\n")
    package(tmp_path / "ros", "here_msgs", One="", Two="std_msgs/msg/Header header 'x'")
    sourced = {"AMENT_PREFIX_PATH": f"{tmp_path}/nowhere:{tmp_path}/overlay::{tmp_path}/ros"}
    rule = "=" * 80
    assert schema_text("here_msgs/msg/One", sourced) == (
        "Two[<=3] twos  # of them\nuint8 X=1\n\n"
        f"{rule}\nMSG: here_msgs/Two\nstd_msgs/msg/Header header 'x'\n"
        f"{rule}\nMSG: std_msgs/Header\nstring<=5 mine\n"
    )
    # What is in none of them is where Python keeps it.
    assert "sec" in schema_text("builtin_interfaces/msg/Time", sourced)


@pytest.mark.parametrize(
    ("type_name", "said"),
    [
        ("nobody_msgs/msg/Thing", "nobody_msgs/msg/Thing is not installed"),
        ("lupin_msgs/msg/Nothing", "lupin_msgs/msg/Nothing is not installed"),
        ("lupin_msgs/Observation", "'lupin_msgs/Observation' is no message type"),
        ("../msg/Observation", "'../msg/Observation' is no message type"),
        ("", "'' is no message type"),
    ],
)
def test_what_is_not_installed_is_named(type_name: str, said: str) -> None:
    with pytest.raises(LookupError, match=said):
        schema_text(type_name)


def test_a_part_that_is_not_installed_is_named_with_the_whole(tmp_path: Path) -> None:
    package(tmp_path, "here_msgs", One="gone_msgs/Two two\n")
    with pytest.raises(LookupError, match="gone_msgs/msg/Two, a part of here_msgs/msg/One, is not"):
        schema_text("here_msgs/msg/One", {"AMENT_PREFIX_PATH": str(tmp_path)})
