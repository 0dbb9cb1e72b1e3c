"""What is recorded, and how it was published: by that, who replays it publishes it again. Pure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

# What rosbag2 calls it in a channel's metadata; without it rosbag2 plays everything as volatile.
QOS_KEY: Final = "offered_qos_profiles"
MESSAGE_ENCODING: Final = "cdr"
PROFILE: Final = "ros2"
# Of the files' names.
SUFFIX: Final = ".mcap"

# One of rosbag2's profiles, as it writes them since its metadata's version 9 (Jazzy), without which
# it takes a file for of that version. No deadline, no lifespan: RMW_DURATION_INFINITE.
_PROFILE: Final = """\
- history: keep_last
  depth: {depth}
  reliability: reliable
  durability: {durability}
  deadline:
    sec: 9223372036
    nsec: 854775807
  lifespan:
    sec: 9223372036
    nsec: 854775807
  liveliness: automatic
  liveliness_lease_duration:
    sec: 9223372036
    nsec: 854775807
  avoid_ros_namespace_conventions: false
"""


@dataclass(frozen=True, slots=True)
class Topic:
    """A topic by its name in the graph of ROS, of `package/msg/Name`.

    `latched` is how many of its last messages a late subscriber gets, 0: it is not latched.
    """

    name: str
    type_name: str
    latched: int = 0

    @property
    def offered_qos(self) -> str:
        """How it is published, as rosbag2 writes that."""
        return _PROFILE.format(
            depth=self.latched or 10, durability="transient_local" if self.latched else "volatile"
        )
