"""Every topic and service of a twin: name, type, QoS and meaning, in one table. Pure.

The nodes publish, subscribe and serve by this table; the reference and the SROS 2 policy are
generated from it. Names are relative to the node's namespace, except for ROS's own global ones.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from lupin_twin.core.parameters import TwinParameters

# Queue depth for the requests of all clients at a service, and for responses at a client. A client
# receives the responses to all other clients too. Beyond the depth, DDS silently drops the oldest.
# ROS's default is 10.
SERVICE_DEPTH: Final = 50


_DEFAULTS: Final = TwinParameters()


@dataclass(frozen=True, slots=True)
class Service:
    """A service, reliable and volatile; `type_name` such as `lupin_msgs/srv/GetField`.

    `parameter` is the twin's parameter that sets the name; empty: only remapping changes it.
    """

    type_name: str
    meaning: str
    name: str = ""
    parameter: str = ""

    def __post_init__(self) -> None:
        """Take the name from the parameter's default."""
        if not self.name:
            object.__setattr__(self, "name", getattr(_DEFAULTS, self.parameter))


@dataclass(frozen=True, slots=True)
class Topic(Service):
    """A topic and its QoS; `type_name` such as `lupin_msgs/msg/TwinState`.

    `is_latched`: TRANSIENT_LOCAL, so that a late subscriber gets the last `depth` messages. The
    bridge caches as many of them, within `max_bytes` in all.
    """

    depth: int = 1
    is_latched: bool = True
    is_reliable: bool = True
    max_bytes: int = 64_000_000  # the largest that a twin itself accepts, see `message_limits`


# Prefix of each layer's topic; the rest is the sensor's name.
LAYERS_BELOW: Final = "twin/field/"

OBSERVATIONS: Final = Topic(
    "lupin_msgs/msg/Observation",
    "one scan, one inspection of flowers, or one failed attempt",
    parameter="observations_topic",
    depth=50,
    max_bytes=8_000_000,
)
DISCOVERED_TAGS: Final = Topic(
    "lupin_msgs/msg/DiscoveredTags",
    "tags that perception has seen, and their places",
    parameter="discovered_tags_topic",
    depth=50,
    max_bytes=16_000_000,
)
MAP: Final = Topic(
    "nav_msgs/msg/OccupancyGrid", "occupancy grid of the floor, from SLAM", parameter="map_topic"
)
CLOCK: Final = Topic(
    "rosgraph_msgs/msg/Clock",
    "simulated time; only with `use_sim_time`",
    "/clock",
    is_latched=False,
    is_reliable=False,
)
SUBSCRIBED: Final = (OBSERVATIONS, DISCOVERED_TAGS, MAP, CLOCK)

# What a robot publishes about itself. The bridge shows it; the twin does not subscribe to it.
ROBOT_POSE: Final = Topic(
    "geometry_msgs/msg/PoseWithCovarianceStamped",
    "where the robot is; also as geometry_msgs/msg/PoseStamped or nav_msgs/msg/Odometry",
    "amcl_pose",
)
ROBOT_PLAN: Final = Topic("nav_msgs/msg/Path", "where it will drive next", "plan")
ROBOT_BATTERY: Final = Topic("sensor_msgs/msg/BatteryState", "its battery", "battery_state")
ROBOT: Final = (ROBOT_POSE, ROBOT_PLAN, ROBOT_BATTERY)

STATE: Final = Topic(
    "lupin_msgs/msg/TwinState",
    "every tag as it is now, `state_publish_rate_hz` times a second",
    parameter="state_topic",
)
TIMES: Final = Topic(
    "lupin_msgs/msg/TwinTimes",
    "when each value of the state was observed; published right after it, with the same stamp",
    "twin/times",
)
LAYERS: Final = Topic(
    "sensor_msgs/msg/PointCloud2",
    "the field of a sensor as points, for each sensor of the parameter `layers`; published on "
    "change, while somebody subscribes",
    f"{LAYERS_BELOW}<sensor>",
)
TAGS: Final = Topic(
    "visualization_msgs/msg/MarkerArray",
    "tags and their names; published on change, while somebody subscribes",
    "twin/tags",
)
PLANTERS: Final = Topic(
    "visualization_msgs/msg/MarkerArray",
    "outlines of planters; published on change, while somebody subscribes",
    "twin/planters",
)
DIAGNOSTICS: Final = Topic(
    "diagnostic_msgs/msg/DiagnosticArray",
    "what the twin reports of itself, once a second: clock, inputs, drops, layers, journal",
    "/diagnostics",
    depth=10,
    is_latched=False,
    max_bytes=4_000_000,
)
PUBLISHED: Final = (STATE, TIMES, LAYERS, TAGS, PLANTERS, DIAGNOSTICS)

GET_FIELD: Final = Service(
    "lupin_msgs/srv/GetField", "one sensor's field over a box", parameter="field_service_name"
)
GET_ESTIMATE: Final = Service(
    "lupin_msgs/srv/GetEstimate", "one sensor's estimate and its error", "twin/get_estimate"
)
GET_ESTIMATE_REPORT: Final = Service(
    "lupin_msgs/srv/GetEstimateReport",
    "how good the estimates are, which sensors have changed, where another tag helps",
    "twin/get_estimate_report",
)
GET_STATE_AT: Final = Service(
    "lupin_msgs/srv/GetStateAt", "state and times as of a past moment", "twin/get_state_at"
)
GET_HISTORY: Final = Service(
    "lupin_msgs/srv/GetHistory", "one sensor's past, or events", "twin/get_history"
)
GET_WRITES: Final = Service(
    "lupin_msgs/srv/GetWrites",
    "the rows of the log in order of arrival, for a copy of it",
    "twin/get_writes",
)
SERVICES: Final = (
    *(GET_FIELD, GET_ESTIMATE, GET_ESTIMATE_REPORT),
    *(GET_STATE_AT, GET_HISTORY, GET_WRITES),
)
# Services that rclpy adds to each node, below the node's name.
OF_EVERY_NODE: Final = (
    *("describe_parameters", "get_parameter_types", "get_parameters", "get_type_description"),
    *("list_parameters", "set_parameters", "set_parameters_atomically"),
)
