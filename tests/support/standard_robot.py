"""A robot that knows ROS's standard messages and nothing of the twin: a separate program.

It stands at one place, then at another, three seconds each, and repeats. The second is warmer.
While it drives, for a second, it reads nothing.
"""

import itertools
from contextlib import suppress
from typing import Any

import rclpy
from geometry_msgs.msg import PoseWithCovarianceStamped
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import RelativeHumidity, Temperature

# Metres, and °C; None: it drives.
STOPS = ((0.2, 21.5), (3.1, 24.0))
ROUND = tuple(step for stop in STOPS for step in [stop] * 30 + [(1.6, None)] * 10)


class StandardRobot(Node):  # type: ignore[misc]  # rclpy is not typed
    """Localisation as AMCL publishes it, sensors as their drivers do."""

    def __init__(self) -> None:
        super().__init__("standard_robot")
        amcl = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._pose = self.create_publisher(PoseWithCovarianceStamped, "/amcl_pose", amcl)
        sensor = qos_profile_sensor_data
        self._temperature = self.create_publisher(Temperature, "/temperature", sensor)
        self._humidity = self.create_publisher(RelativeHumidity, "/humidity", sensor)
        self._round = itertools.cycle(ROUND)
        self.create_timer(0.1, self._tick)

    def _tick(self) -> None:
        x, celsius = next(self._round)
        pose = PoseWithCovarianceStamped()
        pose.header.frame_id = "map"
        pose.pose.pose.position.x = x
        self._send(self._pose, pose)
        if celsius is not None:
            self._send(self._temperature, Temperature(temperature=celsius))
            self._send(self._humidity, RelativeHumidity(relative_humidity=0.6))

    def _send(self, publisher: Any, message: Any) -> None:
        message.header.stamp = self.get_clock().now().to_msg()
        publisher.publish(message)


if __name__ == "__main__":
    rclpy.init()
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(StandardRobot())
