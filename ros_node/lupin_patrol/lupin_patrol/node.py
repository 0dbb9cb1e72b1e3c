"""The patrol's ROS node: publishes a mission's events on the twin's input topics.

Stamps are ROS time (`use_sim_time` included); the pace follows the steady clock. A thread waits for
signals, and no handler runs asynchronously: the caller of `play` has to block them before it starts
any thread. Numbers in messages are written as `float(...)` or `int(...)`: by default rclpy does
not check fields, and serialises a wrong type as garbage.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable, Iterator
from dataclasses import replace
from math import cos, sin
from threading import Event as Flag
from time import monotonic
from typing import Any

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, Pose, PoseStamped, PoseWithCovarianceStamped, Quaternion
from lupin_msgs.msg import DiscoveredTags, Observation
from nav_msgs.msg import OccupancyGrid, Path
from rclpy.duration import Duration
from rclpy.node import Node
from sensor_msgs.msg import BatteryState
from std_msgs.msg import Header

from lupin_patrol.mission import (
    Event,
    MapGrown,
    PassCompleted,
    RobotMoved,
    ScanStatus,
    TagsDiscovered,
    Visited,
    WayPlanned,
    pose_of,
)
from lupin_patrol.perception import Grid
from lupin_twin.core import interfaces
from lupin_twin.core.state import STATUS_OK
from lupin_twin.ros.base_node import NodeUtilities, latched, running_ros, spinning
from lupin_twin.ros.convert import discovered_tags_message, nanoseconds, observation_message
from lupin_twin.ros.parameters import declare, naming, naming_own_parameters
from lupin_twin.runtime import process

# A running twin is discovered within this time. Without the wait, a fast patrol's first
# observations would drop out of the latch before any subscriber could receive them.
SUBSCRIBERS_S = 3.0
# How long a finished patrol waits until its last messages are acknowledged.
_DELIVERY_S = 5.0
_POLL_S = 0.05


class PatrolNode(Node):  # type: ignore[misc]  # rclpy is not typed
    """Publishes observations, tags, map, and the robot's pose, plan and battery, all latched."""

    def __init__(self) -> None:
        with naming_own_parameters():
            super().__init__("lupin_patrol")
        self.utilities = NodeUtilities(self)
        names = ("frame_id", "observations_topic", "discovered_tags_topic", "map_topic")
        self._parameters = declare(self, names)
        self._frame_id = self._parameters.frame_id
        # One pass makes more observations (two for each of 29 tags) than are latched. A twin that
        # starts late misses the oldest ones, until the next pass visits those tags.
        self.observations = self._latched(
            Observation, "observations_topic", interfaces.OBSERVATIONS.depth
        )
        # Each message repeats all earlier content, so only the latest is latched.
        self._discovered_tags = self._latched(DiscoveredTags, "discovered_tags_topic", 1)
        self._map = self._latched(OccupancyGrid, "map_topic", 1)
        self._pose, self._plan, self._battery = (
            self.create_publisher(kind, topic.name, latched(1))
            for kind, topic in (
                (PoseWithCovarianceStamped, interfaces.ROBOT_POSE),
                (Path, interfaces.ROBOT_PLAN),
                (BatteryState, interfaces.ROBOT_BATTERY),
            )
        )

    def publish(self, event: Event) -> None:
        """Publish an event, stamped with the current ROS time."""
        header = Header(stamp=self.get_clock().now().to_msg(), frame_id=self._frame_id)
        match event:
            case MapGrown():
                self._map.publish(occupancy_grid(event.grid, header))
            case TagsDiscovered():
                places = {tag.tag_id: pose_of(tag.position, tag.yaw) for tag in event.tags}
                self._discovered_tags.publish(discovered_tags_message(places, header))
            case Visited():
                stamp_ns = nanoseconds(header.stamp)
                self.observations.publish(observation(event, stamp_ns, self._frame_id))
                if event.write.status != STATUS_OK:
                    self.get_logger().info(
                        f"tag {event.write.tag_id}: {ScanStatus(event.write.status).name},"
                        f" {event.write.status_detail}"
                    )
            case WayPlanned():
                poses = [PoseStamped(header=header, pose=_on_floor(at, 0.0)) for at in event.way]
                self._plan.publish(Path(header=header, poses=poses))
            case RobotMoved():
                # As AMCL publishes it; the simulated pose is exact.
                moved = PoseWithCovarianceStamped(header=header)
                moved.pose.pose = _on_floor(event.position, event.yaw)
                self._pose.publish(moved)
                self._battery.publish(battery_state(event.battery, header.stamp))
            case PassCompleted():
                self.get_logger().info(
                    f"pass {event.pass_index + 1} completed;"
                    f" tags without a successful scan: {', '.join(event.failed) or 'none'}"
                )

    def is_delivered(self) -> bool:
        """Whether every subscriber has acknowledged everything."""
        return all(
            publisher.wait_for_all_acked(Duration())
            for publisher in (self.observations, self._discovered_tags, self._map)
        )

    def _latched(self, message: type[Any], parameter: str, depth: int) -> Any:
        topic = getattr(self._parameters, parameter)
        with naming(parameter, topic):
            return self.create_publisher(message, topic, latched(depth))


def play(
    events: Iterator[Event], *, begin_s: float, speed: float, once: bool, ros_arguments: list[str]
) -> None:
    """Play events until a stop signal comes or, with `once`, the first pass is completed.

    Playing starts at the patrol time `begin_s`; no event is earlier. `speed` is patrol seconds per
    second. `ros_arguments` is the whole command line.
    Raises ParameterError before anything is published.
    """
    stop = process.stop_flag()
    with running_ros(ros_arguments):
        node = PatrolNode()
        with spinning(node):
            node.get_logger().info(f"patrol starts at speed {speed:g}")
            subscribers = node.observations.get_subscription_count
            if _stopped_before(stop, lambda: subscribers() > 0, SUBSCRIBERS_S):
                return
            start = monotonic()
            for event in events:
                if stop.wait(max(0.0, start + (event.at_s - begin_s) / speed - monotonic())):
                    return
                node.publish(event)
                if once and isinstance(event, PassCompleted):
                    break
            _stopped_before(stop, node.is_delivered, _DELIVERY_S)


def _stopped_before(stop: Flag, condition: Callable[[], bool], timeout_s: float) -> bool:
    """Wait for a condition, at most `timeout_s`; returns whether a stop signal came."""
    deadline = monotonic() + timeout_s
    while not condition() and monotonic() < deadline:
        if stop.wait(_POLL_S):
            return True
    return False


SOURCE = "lupin_patrol"


def observation(event: Visited, stamp_ns: int, frame_id: str) -> Observation:
    """Return the message of a scan or an inspection."""
    mission = f"patrol-{event.pass_index + 1:04d}"
    write = replace(event.write, stamp_ns=stamp_ns, source=SOURCE, mission=mission)
    message = observation_message(write, frame_id)
    message.tag_reading.sim_time_of_day_seconds = float(event.time_of_day_s)
    return message


def occupancy_grid(grid: Grid, header: Header) -> OccupancyGrid:
    """Return the map."""
    message = OccupancyGrid(header=header, data=array("b", grid.cells))
    message.info.map_load_time = header.stamp
    message.info.resolution = float(grid.resolution_m)
    message.info.width = int(grid.width)
    message.info.height = int(grid.height)
    message.info.origin.position = Point(x=float(grid.origin[0]), y=float(grid.origin[1]), z=0.0)
    return message


def battery_state(level: float, stamp: Time) -> BatteryState:
    """Return the battery state; quantities that are not simulated are NaN, as BatteryState asks."""
    message = BatteryState(header=Header(stamp=stamp), percentage=float(level), present=True)
    for name in ("voltage", "temperature", "current", "charge", "capacity", "design_capacity"):
        setattr(message, name, float("nan"))
    message.power_supply_status = BatteryState.POWER_SUPPLY_STATUS_DISCHARGING
    return message


def _on_floor(point: tuple[float, float], yaw: float) -> Pose:
    return Pose(
        position=Point(x=float(point[0]), y=float(point[1]), z=0.0),
        orientation=Quaternion(x=0.0, y=0.0, z=sin(yaw / 2), w=cos(yaw / 2)),
    )
